// The one door to Eigen: Laplacians of triangle meshes, factored once and solved many times.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "scene/base/math.h"

namespace lumel {

/// Sparse Cholesky factor L L^T (Eigen's SimplicialLLT with the AMD ordering of Amestoy, Davis and Duff 1996) of the
/// matrix sum over triangle sides (i, j) of w (e_i - e_j)(e_i - e_j)^T, with point 0 held by a weight of 1.
/// Entries are floats, which halves the factor's memory: a solution is good to three digits or more, and whoever needs
/// more solves for the residual.
class LaplacianSolver {
 public:
  struct Triangle {
    std::array<std::uint32_t, 3> points;
    std::array<double, 3> weights;  // of the sides (k, k + 1)
  };
  using Triangles = std::function<Triangle(std::size_t t)>;

  LaplacianSolver(std::size_t points, std::size_t triangles);
  ~LaplacianSolver();

  /// The triangles are connected over shared points; they stay the same from call to call, their weights need not.
  /// False: a weight is not finite, or the matrix is not positive definite.
  bool factorize(const Triangles& triangle);

  /// `x`: the right-hand side per point, replaced by the solution. To be called after a factorization that succeeded.
  void solve(std::span<Vec2d> x) const;

 private:
  struct Factor;
  std::size_t points_, triangles_;
  std::unique_ptr<Factor> factor_;
};

}  // namespace lumel
