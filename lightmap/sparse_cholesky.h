// The one door to Eigen: Laplacians of triangle meshes factored and solved.
// Multifrontal (Duff and Reid 1983, "The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations"), along
// the tree of nested dissection.
#pragma once

#include <functional>

#include "lightmap/nested_dissection.h"

namespace lumel {

/// L L^T of the matrix sum over triangle sides (i, j) of w (e_i - e_j)(e_i - e_j)^T, with one point held by a weight of 1.
/// The factor is kept in floats, packed: 4 bytes per entry. So a solution is good to about five digits; who wants more
/// solves for what is still missing.
class SparseCholesky {
 public:
  SparseCholesky(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// `weights(t)`: of triangle t's sides (k, k + 1); parallel over parts of the mesh, the same for any thread count.
  /// False: the matrix is not positive definite (the triangles do not hang together).
  bool factorize(const std::function<std::array<double, 3>(std::size_t)>& weights);

  /// `values`: per point, the right side, replaced by the solution.
  void solve(std::vector<Vec2d>& values) const;

 private:
  struct Front {  // a node of the dissection: its points are eliminated at once
    std::uint32_t begin = 0, end = 0;            // ranks of its points
    std::int32_t left = -1, right = -1;          // fronts before it
    std::uint32_t firstRow = 0, rows = 0;        // into rows_: ranks beyond `end` that it reaches, ascending
    std::uint32_t firstTriangle = 0, triangles = 0;  // into order of triangles by their first point
    std::uint32_t subtree = 1;                   // fronts below it and itself
    std::size_t values = 0;                      // into values_: its columns, each from the diagonal down
  };
  struct Workspace;

  void analyse();
  bool eliminate(std::uint32_t front, const std::function<std::array<double, 3>(std::size_t)>& weights, Workspace& work,
                 std::vector<std::vector<double>>& updates);
  std::uint32_t localRow(const Front& front, std::uint32_t rank) const;

  std::vector<std::array<std::uint32_t, 3>> ranks_;  // per triangle, in the order of fronts
  std::vector<std::uint32_t> triangle_;              // its number
  std::vector<std::uint32_t> rank_;                  // per point
  std::vector<Front> fronts_;                        // children before parents
  std::vector<std::uint32_t> rows_;
  std::vector<float> values_;
};

}  // namespace lumel
