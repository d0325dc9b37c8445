#include "lightmap/charts/laplacian_solver.h"

#include <Eigen/SparseCholesky>

namespace lumel {

namespace {

/// The lower triangle of the Laplacian with point 0 held.
Eigen::SparseMatrix<float> lowerTriangle(std::size_t points, std::size_t triangles,
                                         const LaplacianSolver::Triangles& triangle) {
  const auto size = static_cast<Eigen::Index>(points);
  std::vector<double> diagonal(points, 0.0);
  diagonal[0] = 1;
  std::vector<Eigen::Triplet<float>> entries;
  entries.reserve(3 * triangles + points);
  for (std::size_t t = 0; t < triangles; ++t) {
    const auto [corner, w] = triangle(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = corner[k];
      const std::uint32_t j = corner[(k + 1) % 3];
      diagonal[i] += w[k];
      diagonal[j] += w[k];
      entries.emplace_back(static_cast<int>(std::max(i, j)), static_cast<int>(std::min(i, j)),
                           static_cast<float>(-w[k]));
    }
  }
  for (std::size_t i = 0; i < points; ++i)
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), static_cast<float>(diagonal[i]));
  Eigen::SparseMatrix<float> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

struct LaplacianSolver::Factor {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<float>> llt;
  bool analysed = false;
};

LaplacianSolver::LaplacianSolver(std::size_t points, std::size_t triangles)
    : points_(points), triangles_(triangles), factor_(std::make_unique<Factor>()) {}

LaplacianSolver::~LaplacianSolver() = default;

bool LaplacianSolver::factorize(const Triangles& triangle) {
  const Eigen::SparseMatrix<float> matrix = lowerTriangle(points_, triangles_, triangle);
  if (!matrix.coeffs().allFinite()) return false;
  if (!factor_->analysed) factor_->llt.analyzePattern(matrix);
  factor_->analysed = true;
  factor_->llt.factorize(matrix);
  return factor_->llt.info() == Eigen::Success;
}

void LaplacianSolver::solve(std::span<Vec2d> x) const {
  Eigen::Matrix<float, Eigen::Dynamic, 2> right(static_cast<Eigen::Index>(x.size()), 2);
  for (Eigen::Index i = 0; i < right.rows(); ++i) {
    right(i, 0) = static_cast<float>(x[static_cast<std::size_t>(i)].x);
    right(i, 1) = static_cast<float>(x[static_cast<std::size_t>(i)].y);
  }
  right = factor_->llt.solve(right);
  for (Eigen::Index i = 0; i < right.rows(); ++i) x[static_cast<std::size_t>(i)] = Vec2d(right(i, 0), right(i, 1));
}

}  // namespace lumel
