// Furnaces: in a closed box whose walls all emit Le and reflect a, radiance is the same everywhere and known.
#include <gtest/gtest.h>

#include "tests/baker/test_scene.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

using namespace testing_scene;

double luminanceMean(const Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) sum += static_cast<double>(luminance(image.rgb(x, y)));
  return sum / (image.width * image.height);
}

struct Mean {
  double value = 0;
  double standardError = 0;
};

/// Mean of the flat maps of a furnace over all walls, its standard error from independent seeds.
Mean furnace(float albedo, int bounces, int samples) {
  TestScene test;
  test.addRoom({0, 0, 0}, {1, 1, 1}, {.material = test.addMaterial(Vec3(albedo), Vec3(1.0f))});
  double sum = 0, squares = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const BakeResult result = test.bake({.samples = samples,
                                         .bounces = bounces,
                                         .seed = static_cast<std::uint64_t>(seed) + 1,
                                         .encoding = rnmEncoding(Projection::Raw)});
    double mean = 0;
    for (const BakedPage& page : result.pages) mean += luminanceMean(page.flat) / 6;
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kSeeds;
  return {mean, std::sqrt(std::max(0.0, squares / kSeeds - mean * mean) / (kSeeds - 1))};
}

TEST(Furnace, PartialSumsOfBounces) {
  for (const int bounces : {0, 1, 2, 4, 7}) {
    double expected = 0;
    for (int k = 0; k <= bounces; ++k) expected += std::pow(0.5, k);
    const Mean mean = furnace(0.5f, bounces, 64);
    EXPECT_NEAR(mean.value, expected, 4 * mean.standardError + 2e-5) << bounces << " bounces";
    EXPECT_LT(mean.standardError, 0.005 * expected);
  }
}

TEST(Furnace, InfiniteBounces) {
  // The rest of the series after N bounces is below 1e-9 of the sum.
  const std::array<std::pair<float, int>, 3> cases = {{{0.2f, 13}, {0.5f, 30}, {0.8f, 100}}};
  for (const auto& [rho, bounces] : cases) {
    const double expected = 1 / (1 - static_cast<double>(rho));
    const Mean mean = furnace(rho, bounces, 64);
    EXPECT_NEAR(mean.value, expected, 4 * mean.standardError + 2e-5 * expected) << "rho " << rho;
    EXPECT_LT(mean.standardError, 0.005 * expected) << "rho " << rho;
    RecordProperty("relative_error_rho_" + std::to_string(rho), std::to_string(mean.value / expected - 1));
    std::printf("furnace rho %.1f: %.6f, expected %.6f, off by %.4f%% +- %.4f%%\n", static_cast<double>(rho),
                mean.value, expected, 100 * (mean.value / expected - 1), 100 * mean.standardError / expected);
  }
}

// Every map of a uniformly lit hemisphere is (1 + 1/sqrt3)/2 of the flat one.
// Paths end by roulette alone, so that the series is whole however slowly it dies. Every sample is the length of a
// path, which varies by about 1 / (1 - albedo): 8 seeds of 6 walls of 16 texels and 32 samples leave 0.7% of the sum,
// and the first 65 terms at .99 are 48% of it.
TEST(Furnace, PathsFollowTheSeriesToItsEnd) {
  for (const float rho : {0.95f, 0.99f, 0.999f}) {
    const double expected = 1 / (1 - static_cast<double>(rho));
    const Mean mean = furnace(rho, kAllBounces, rho > 0.995f ? 8 : 32);
    EXPECT_NEAR(mean.value, expected, 4 * mean.standardError) << "rho " << rho;
    EXPECT_LT(mean.standardError, 0.02 * expected) << "rho " << rho;
    std::printf("path furnace rho %.3f: %.3f of %.3f +- %.3f\n", static_cast<double>(rho), mean.value, expected,
                mean.standardError);
  }
}

// Where albedo is 1 light never dies: its end is told. Where it can leave, nothing is cut off.
TEST(Furnace, PathsThatNeverEndAreTold) {
  TestScene closed;
  closed.addRoom({0, 0, 0}, {1, 1, 1}, {.material = closed.addMaterial(Vec3(1.0f), Vec3(1.0f)), .texels = 1});
  const BakeResult endless = closed.bake({.samples = 4, .bounces = kAllBounces});
  EXPECT_GT(endless.stats.cutPaths, 0u);
  ASSERT_EQ(endless.stats.notes.size(), 1u);
  EXPECT_TRUE(mentions(endless.stats.notes[0], "bounces"));
  TestScene open;
  open.scene.environment.color = Vec3(1.0f);
  const int white = open.addMaterial(Vec3(1.0f));
  open.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.material = white});
  open.addRectangle({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, {.material = white});
  EXPECT_EQ(open.bake({.samples = 64, .bounces = kAllBounces}).stats.cutPaths, 0u);
}

TEST(Furnace, BasisMaps) {
  TestScene test;
  test.addRoom({0, 0, 0}, {1, 1, 1}, {.material = test.addMaterial(Vec3(0.5f), Vec3(1.0f))});
  const double tilted = 0.7886751 * 1.75;
  expectAgreement(deviation(test, {.samples = 64, .bounces = 2}, 0, [&](const Vec3d&) {
    return Maps{1.75, tilted, tilted, tilted};
  }));
}

// Light that comes from reflection alone: a room of albedo a under a point light at its centre. Energy balance: all
// flux 4 pi I lands on the walls, and the mean irradiance is flux / area * sum of a^k over bounces.
TEST(Furnace, PointLightEnergyBalance) {
  TestScene test;
  test.addRoom({-1, -1, -1}, {1, 1, 1}, {.material = test.addMaterial(Vec3(0.6f))});
  Light light;
  light.intensity = 2.0f;
  test.scene.lights = {light};
  const double direct = 4 * std::numbers::pi * 2 / 24 / std::numbers::pi;
  for (const int bounces : {0, 3}) {
    double series = 0;
    for (int k = 0; k <= bounces; ++k) series += std::pow(0.6, k);
    double sum = 0, squares = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const BakeResult result =
          test.bake({.samples = 128, .bounces = bounces, .seed = static_cast<std::uint64_t>(seed)});
      double mean = 0;
      for (const BakedPage& page : result.pages) mean += luminanceMean(page.flat) / 6;
      sum += mean;
      squares += mean * mean;
    }
    const double mean = sum / kSeeds;
    const double standardError = std::sqrt(std::max(0.0, squares / kSeeds - mean * mean) / (kSeeds - 1));
    EXPECT_NEAR(mean, direct * series, 4 * standardError + 2e-5 * direct) << bounces;
    EXPECT_LT(standardError, 0.005 * mean);
  }
}

}  // namespace
}  // namespace lumel
