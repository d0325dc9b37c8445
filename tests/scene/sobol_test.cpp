#include "scene/base/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace lumel {
namespace {

TEST(Sobol, SecondDimensionMatchesDirectionNumbers) {
  // Direction numbers of the primitive polynomial x + 1: v_0 = 1/2, v_k = v_{k-1} ^ (v_{k-1} >> 1).
  for (const std::uint32_t index : {0u, 1u, 2u, 3u, 12345u, 0x80000001u, 0xffffffffu, 0xdeadbeefu}) {
    std::uint32_t expected = 0;
    std::uint32_t v = 0x80000000u;
    for (int bit = 0; bit < 32; ++bit, v ^= v >> 1)
      if ((index >> bit) & 1u) expected ^= v;
    EXPECT_EQ(reverseBits(sobolSecondReversed(index)), expected) << index;
  }
}

TEST(Sobol, ReverseBitsIsAnInvolution) {
  EXPECT_EQ(reverseBits(1u), 0x80000000u);
  EXPECT_EQ(reverseBits(0x0000f00fu), 0xf00f0000u);
  for (std::uint32_t x = 1; x < 100000; x = x * 3 + 7) EXPECT_EQ(reverseBits(reverseBits(x)), x);
}

// The property that everything else rests on: an aligned block of 2^m points has exactly one in every elementary
// interval of area 2^-m, of every shape.
TEST(Sobol, AlignedBlocksAreNets) {
  for (const std::uint32_t seed : {0u, 1u, 77u, 0xabcdef01u})
    for (const int m : {0, 1, 4, 7, 10})
      for (const std::uint32_t block : {0u, 1u, 5u})
        for (int a = 0; a <= m; ++a) {
          std::set<std::pair<int, int>> cells;
          const std::uint32_t n = 1u << m;
          for (std::uint32_t i = block * n; i < (block + 1) * n; ++i) {
            const Vec2 u = sobol2D(i, seed);
            ASSERT_TRUE(u.x >= 0 && u.x < 1 && u.y >= 0 && u.y < 1);
            cells.insert({static_cast<int>(std::ldexp(u.x, a)), static_cast<int>(std::ldexp(u.y, m - a))});
          }
          EXPECT_EQ(cells.size(), n) << "seed " << seed << " m " << m << " split " << a;
        }
}

TEST(Sobol, OneDimensionIsStratified) {
  for (const std::uint32_t seed : {3u, 99u}) {
    std::set<int> cells;
    for (std::uint32_t i = 256; i < 512; ++i) cells.insert(static_cast<int>(sobol1D(i, seed) * 256.0f));
    EXPECT_EQ(cells.size(), 256u);
  }
}

// Scrambles of different seeds must be independent: the error of a mean over many seeds falls like that of independent
// estimates, and two patterns of one texel are uncorrelated.
TEST(Sobol, SeedsAndPatternsAreUncorrelated) {
  constexpr int kSeeds = 20000;
  double sumX = 0, sumY = 0, sumXX = 0, sumXY = 0, sumPatterns = 0;
  for (int s = 0; s < kSeeds; ++s) {
    const TexelSampler sampler(7, 0, static_cast<std::uint32_t>(s % 141), static_cast<std::uint32_t>(s / 141));
    const Vec2 u = sampler.get2D(5, 1) - 0.5f;
    const Vec2 v = sampler.get2D(5, 2) - 0.5f;
    sumX += u.x;
    sumY += u.y;
    sumXX += u.x * u.x;
    sumXY += u.x * u.y;
    sumPatterns += u.x * v.x;
  }
  // Each sum has variance kSeeds / 12 (or / 144 for products): five standard deviations.
  EXPECT_LT(std::abs(sumX), 5 * std::sqrt(kSeeds / 12.0));
  EXPECT_LT(std::abs(sumY), 5 * std::sqrt(kSeeds / 12.0));
  EXPECT_LT(std::abs(sumXY), 5 * std::sqrt(kSeeds / 144.0));
  EXPECT_LT(std::abs(sumPatterns), 5 * std::sqrt(kSeeds / 144.0));
  EXPECT_NEAR(sumXX / kSeeds, 1.0 / 12, 5 * std::sqrt(1.0 / 180 / kSeeds));
}

TEST(Sobol, IntegratesASmoothFunctionFarBetterThanRandom) {
  // Integral of x^2 + x y over the unit square = 7/12. With 1024 random points the error is about 0.012.
  double worst = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    double sum = 0;
    for (std::uint32_t i = 0; i < 1024; ++i) {
      const Vec2 u = sobol2D(i, seed);
      sum += static_cast<double>(u.x * u.x + u.x * u.y);
    }
    worst = std::max(worst, std::abs(sum / 1024 - 7.0 / 12));
  }
  EXPECT_LT(worst, 2e-4);
}

}  // namespace
}  // namespace lumel
