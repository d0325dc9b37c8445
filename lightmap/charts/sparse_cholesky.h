// The one door to Eigen: Laplacians of triangle meshes factored and solved.
// Multifrontal (Duff and Reid 1983, "The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations"), along
// the tree of nested dissection.
#pragma once

#include <functional>
#include <memory>

#include "lightmap/charts/nested_dissection.h"

namespace lumel {

/// L L^T of the matrix sum over triangle sides (i, j) of w (e_i - e_j)(e_i - e_j)^T, with one point held by a weight
/// of 1. The factor is kept in 16 bits an entry, in steps of each column's own. So a solution is good to two or three
/// digits; who wants more solves for what is still missing.
class SparseCholesky {
 public:
  /// Of triangle t's sides (k, k + 1).
  using Weights = std::function<std::array<double, 3>(std::size_t t)>;

  /// The triangles must outlive it.
  SparseCholesky(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// Parallel over parts of the mesh, the same for any thread count.
  /// False: the matrix is not positive definite (the triangles do not hang together).
  bool factorize(const Weights& weights);

  /// A point's place in the order of elimination.
  std::uint32_t rankOf(std::size_t point) const { return rank_[point]; }

  /// `x`: the right side by rank, replaced by the solution.
  void solve(std::span<Vec2d> x) const;

 private:
  struct Front {                                     // a node of the dissection: its points are eliminated at once
    std::uint32_t begin = 0, end = 0;                // ranks of its points
    std::int32_t left = -1, right = -1;              // fronts before it
    std::uint32_t firstRow = 0, rows = 0;            // into rows_: ranks beyond `end` that it reaches, ascending
    std::uint32_t firstTriangle = 0, triangles = 0;  // into order of triangles by their first point
    std::uint32_t subtree = 1;                       // fronts below it and itself
    std::size_t values = 0;                          // into values_: its columns, each from the diagonal down
  };
  struct Workspace;
  class Update;

  void analyse();
  void assemble(std::uint32_t front, const Weights& weights, Workspace& work, std::vector<Update>& updates) const;
  bool eliminate(std::uint32_t front, const Weights& weights, Workspace& work, std::vector<Update>& updates);
  std::array<std::uint32_t, 3> ranksOf(std::uint32_t triangle) const;
  void store(const Front& front, const double* panel);
  std::uint32_t localRow(const Front& front, std::uint32_t rank) const;

  std::span<const std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> order_;  // of triangles, by fronts
  std::vector<std::uint32_t> rank_;   // per point
  std::vector<Front> fronts_;         // children before parents
  std::vector<std::uint32_t> rows_;
  std::vector<float> step_;  // per rank, of its column
  std::unique_ptr<std::int16_t[]> values_;
};

}  // namespace lumel
