#include "lightmap/charts/laplacian_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lumel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// A square of triangles with weights that differ, and what the matrix is by its definition.
struct Laplacian {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

  explicit Laplacian(std::uint32_t cells) {
    const std::uint32_t width = cells + 1;
    for (std::uint32_t y = 0; y < width; ++y)
      for (std::uint32_t x = 0; x < width; ++x) points.push_back(Vec3d(x, y, 0));
    for (std::uint32_t y = 0; y < cells; ++y)
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = y * width + x;
        triangles.push_back({a, a + 1, a + width + 1});
        triangles.push_back({a, a + width + 1, a + width});
      }
  }

  static std::array<double, 3> weights(std::size_t t) {
    return {1 + 0.5 * std::sin(static_cast<double>(t)), 0.7, 0.2 + static_cast<double>(t % 5)};
  }

  template <class Weights>
  LaplacianSolver::Triangles withWeights(Weights weightsOf) const {
    return [this, weightsOf](std::size_t t) -> LaplacianSolver::Triangle { return {triangles[t], weightsOf(t)}; };
  }

  std::vector<Vec2d> times(const std::vector<Vec2d>& x) const {
    std::vector<Vec2d> product(x.size(), Vec2d(0.0));
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t i = triangles[t][k], j = triangles[t][(k + 1) % 3];
        const Vec2d flow = weights(t)[k] * (x[i] - x[j]);
        product[i] += flow;
        product[j] -= flow;
      }
    return product;
  }
};

TEST(LaplacianSolver, SolvesALaplacianUpToAShift) {
  for (const std::uint32_t cells : {1u, 2u, 7u, 40u, 90u}) {
    const Laplacian laplacian(cells);
    LaplacianSolver solver(laplacian.points.size(), laplacian.triangles.size());
    ASSERT_TRUE(solver.factorize(laplacian.withWeights(Laplacian::weights)));
    std::vector<Vec2d> expected;
    for (const Vec3d& p : laplacian.points) expected.push_back({std::sin(p.x) + 0.1 * p.y, std::cos(0.3 * p.x * p.y)});
    const std::vector<Vec2d> right = laplacian.times(expected);
    std::vector<Vec2d> solved(right.size(), Vec2d(0.0));
    for (int round = 0; round < 6; ++round) {  // each solves for what is missing
      std::vector<Vec2d> missing = laplacian.times(solved);
      for (std::size_t i = 0; i < missing.size(); ++i) missing[i] = right[i] - missing[i];
      solver.solve(missing);
      for (std::size_t i = 0; i < missing.size(); ++i) solved[i] += missing[i];
    }
    const Vec2d shift = solved[0] - expected[0];
    double worst = 0;
    for (std::size_t i = 0; i < solved.size(); ++i)
      worst = std::max(worst, glm::length(solved[i] - shift - expected[i]));
    // Each round takes off what a factor of floats can: two digits at the least.
    EXPECT_LT(worst, 1e-9) << cells;
  }
}

TEST(LaplacianSolver, RefusesWeightsThatAreNoNumberOrGiveNoPositiveMatrix) {
  const Laplacian laplacian(4);
  LaplacianSolver solver(laplacian.points.size(), laplacian.triangles.size());
  EXPECT_FALSE(solver.factorize(laplacian.withWeights([](std::size_t) {
    return std::array<double, 3>{1, std::numeric_limits<double>::quiet_NaN(), 1};
  })));
  EXPECT_FALSE(solver.factorize(laplacian.withWeights([](std::size_t) { return std::array<double, 3>{-1, -1, -1}; })));
  EXPECT_TRUE(solver.factorize(laplacian.withWeights(Laplacian::weights)));  // and can be used again
}

}  // namespace
}  // namespace lumel
