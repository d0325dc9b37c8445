// One connected smooth surface of many triangles: charts and time stay sane.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/base/stopwatch.h"
#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

TEST(LargeTerrain, OfAHundredThousandTrianglesIsAFewSoundCharts) {
  const Scene scene = terrain(224, 100);
  const Stopwatch stopwatch;
  const AtlasResult result = chartsOf(scene, 8, 1024);
  const double seconds = stopwatch.seconds();
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles, 2u * 224 * 224);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_LE(f.charts, 4u);
  EXPECT_LE(f.worstStretch, 1.15);
  // About 2 s alone on one core; a quadratic step would take minutes. Wide, because test machines are shared.
  EXPECT_LT(seconds, 60);
}

TEST(LargePipe, OfAMillionTrianglesUnrollsWhole) {
  constexpr std::uint32_t kSides = 1000, kRings = 500;
  std::vector<Vec3> positions, normals;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t y = 0; y <= kRings; ++y)
    for (std::uint32_t x = 0; x < kSides; ++x) {
      const double a = 2 * std::numbers::pi * x / kSides;
      positions.push_back(Vec3(10 * std::cos(a), 10 * std::sin(a), 0.1 * y));
      normals.push_back(Vec3(std::cos(a), std::sin(a), 0));
    }
  for (std::uint32_t y = 0; y < kRings; ++y)
    for (std::uint32_t x = 0; x < kSides; ++x) {
      const std::uint32_t a = y * kSides + x, b = y * kSides + (x + 1) % kSides;
      for (const std::uint32_t i : {a, b, b + kSides, a, b + kSides, a + kSides}) indices.push_back(i);
    }
  const AtlasResult result = chartsOf(sceneOf(std::move(positions), std::move(indices), std::move(normals)), 10, 1024);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles, 2u * kSides * kRings);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_EQ(f.charts, 1u);
  EXPECT_LE(f.worstStretch, 1.001);
  // 628.3 x 500 texels, to within the texels of its border.
  EXPECT_NEAR(f.coveredTexels, 628.3 * 500, 2 * (628 + 500));
}

TEST(LargeTerrain, ThatIsLargerThanAPageIsCutToFit) {
  const AtlasResult result = chartsOf(terrain(100, 100), 8, 256);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_EQ(f.outside, 0u);
  EXPECT_GE(result.atlas.pages.size(), 10u);
  // 800 x 800 texels and more, as the terrain is not flat.
  EXPECT_GT(f.coveredTexels, 640000);
}

}  // namespace
}  // namespace lumel
