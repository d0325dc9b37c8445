#include "ssbump/occlusion/samples.h"

#include <gtest/gtest.h>

#include <vector>

namespace lumel::ssbump {
namespace {

TEST(HemisphereSamples, AreUnitAboveTheBaseAndUniform) {
  for (RaySampling sampling : {RaySampling::Random, RaySampling::Stratified, RaySampling::Sobol}) {
    const HemisphereSamples samples(sampling, 4096, 1);
    Vec3d sum(0);
    double squares = 0;
    for (int i = 0; i < 4096; ++i) {
      const Vec3 w = samples.direction(77, i);
      EXPECT_NEAR(glm::length(w), 1, 1e-5);
      EXPECT_GE(w.z, 0);
      sum += Vec3d(w);
      squares += static_cast<double>(w.z) * static_cast<double>(w.z);
    }
    // Means of x, y, z, z^2 under a uniform hemisphere: 0, 0, 1/2, 1/3; four standard errors of the random case.
    EXPECT_NEAR(sum.x / 4096, 0, 4 * 0.577 / 64);
    EXPECT_NEAR(sum.y / 4096, 0, 4 * 0.577 / 64);
    EXPECT_NEAR(sum.z / 4096, 0.5, 4 * 0.289 / 64);
    EXPECT_NEAR(squares / 4096, 1.0 / 3, 4 * 0.298 / 64);
  }
}

TEST(HemisphereSamples, StrataHoldOneEachForTheLiteraturesThreeHundred) {
  const HemisphereSamples samples(RaySampling::Stratified, 300, 5);
  std::vector<int> cells(300);
  for (int i = 0; i < 300; ++i) {
    const Vec3 w = samples.direction(123456789, i);
    const double azimuth = std::atan2(static_cast<double>(w.y), static_cast<double>(w.x)) / (2 * std::numbers::pi);
    const int row = static_cast<int>((azimuth < 0 ? azimuth + 1 : azimuth) * 20),
              column = static_cast<int>(static_cast<double>(w.z) * 15);
    ++cells[static_cast<std::size_t>(std::min(row, 19) * 15 + std::min(column, 14))];
  }
  // Points within float rounding of a cell's edge may count for its neighbour.
  EXPECT_GE(std::count(cells.begin(), cells.end(), 1), 298);
}

TEST(HemisphereSamples, SobolFillsBothAxesEvenly) {
  // A (0,2)-sequence: of 256 points one in each 1/256 of either axis, whatever the scramble.
  for (std::uint64_t key : {0ull, 1ull, 99999999999ull}) {
    const HemisphereSamples samples(RaySampling::Sobol, 256, 9);
    std::vector<int> heights(256);
    for (int i = 0; i < 256; ++i) ++heights[static_cast<std::size_t>(samples.direction(key, i).z * 256)];
    EXPECT_EQ(std::count(heights.begin(), heights.end(), 1), 256);
  }
}

TEST(HemisphereSamples, DependOnTexelIndexAndSeedAlone) {
  const HemisphereSamples a(RaySampling::Sobol, 64, 1), b(RaySampling::Sobol, 64, 1), c(RaySampling::Sobol, 64, 2);
  EXPECT_EQ(a.direction(5, 7), b.direction(5, 7));
  EXPECT_NE(a.direction(5, 7), c.direction(5, 7));
  EXPECT_NE(a.direction(5, 7), a.direction(6, 7));
}

}  // namespace
}  // namespace lumel::ssbump
