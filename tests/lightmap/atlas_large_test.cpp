// One connected smooth surface of many triangles: charts and time stay sane.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

Scene terrain(int cells, double side) {
  std::vector<Vec3> positions, normals;
  std::vector<std::uint32_t> indices;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) {
      const double u = side * x / cells, v = side * y / cells;
      positions.push_back(Vec3(u, v, 3 * std::sin(0.11 * u) * std::cos(0.13 * v) + 0.8 * std::sin(0.43 * u + 1) * std::sin(0.37 * v)));
      const double du = 0.33 * std::cos(0.11 * u) * std::cos(0.13 * v) + 0.344 * std::cos(0.43 * u + 1) * std::sin(0.37 * v);
      const double dv = -0.39 * std::sin(0.11 * u) * std::sin(0.13 * v) + 0.296 * std::sin(0.43 * u + 1) * std::cos(0.37 * v);
      normals.push_back(Vec3(glm::normalize(Vec3d(-du, -dv, 1))));
    }
  const auto at = [cells](int x, int y) { return static_cast<std::uint32_t>(y * (cells + 1) + x); };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x)
      for (const std::uint32_t i : {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y), at(x + 1, y + 1), at(x, y + 1)}) indices.push_back(i);
  return sceneOf(std::move(positions), std::move(indices), std::move(normals));
}

TEST(LargeTerrain, OfAHundredThousandTrianglesIsAFewSoundCharts) {
  const Scene scene = terrain(224, 100);
  const auto start = std::chrono::steady_clock::now();
  const AtlasResult result = chartsOf(scene, 8, 1024);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles, 2u * 224 * 224);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_LE(f.charts, 4u);
  EXPECT_LE(f.worstStretch, 1.15);
  // About 2 s alone on one core; a quadratic step would take minutes. Wide, because test machines are shared.
  EXPECT_LT(seconds, 60);
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
