// One connected smooth surface of a million triangles, flattened as one chart.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

/// Largest resident memory of this process so far, in bytes; 0 where the system does not tell.
double peakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return 1024 * std::stod(line.substr(6));
  return 0;
}

TEST(MillionTriangles, OfATerrainAreOneSoundChartWithinItsMemory) {
  const Scene scene = terrain(710, 100);
  const double before = peakMemory();
  const AtlasResult result = chartsOf(scene, 8, 1024);
  const double perTriangle = (peakMemory() - before) / (2 * 710 * 710);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles, 2u * 710 * 710);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_EQ(f.charts, 1u);
  EXPECT_LE(f.worstStretch, 1.15);
  // 433 bytes measured, most of it the factor of the flattening's matrix, which Eigen keeps with 8 bytes an entry, and
  // OpenMesh's connectivity. (A factor of our own with 2 bytes an entry took 186 in all; tests/bench/EXPERIMENTS.md.)
#ifndef __SANITIZE_ADDRESS__  // which pads every allocation
  EXPECT_LE(perTriangle, 480);
#endif
}

}  // namespace
}  // namespace lumel
