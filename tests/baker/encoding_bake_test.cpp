// Encodings from the samples to the files and back: nothing on the way may know how many maps there are.
#include <gtest/gtest.h>

#include <filesystem>

#include "baker/bake/finish.h"
#include "baker/files/read/baked_scene.h"
#include "baker/files/write/bake_files.h"
#include "tests/baker/test_scene.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A square under an even sky of radiance 1: irradiance / pi is (1 + N.z) / 2 on a normal N in its tangent space.
TestScene squareUnderSky(Integrator integrator) {
  TestScene test;
  test.integrator = integrator;
  test.addRectangle({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {.texels = 8});
  test.scene.environment.color = Vec3(1.0f);
  return test;
}

/// Baked, finished with denoising and a ring of dilation, written, and read back.
Expected<BakedScene> bakeToFilesAndBack(const TestScene& test, const BakeOptions& options) {
  BakeResult result = test.bake(options);
  finishPages(result.pages, test.atlas, findTexels(test.atlas), {.denoise = true, .rings = 1});
  AtlasResult atlas;
  atlas.atlas = test.atlas;
  const std::filesystem::path dir = scratch();
  BakeRecord record;
  record.bakeOptions = options;
  if (auto written = writeBake(dir, test.scene, atlas, result, record); !written) return written.error();
  return readBake(dir);
}

class EachIntegrator : public testing::TestWithParam<Integrator> {};

TEST_P(EachIntegrator, TwoBandsOfAnEvenSkyAreTheirClosedForm) {
  const auto baked = bakeToFilesAndBack(squareUnderSky(GetParam()), {.samples = 1024, .encoding = sh1Encoding()});
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->encoding->name(), "sh1");
  ASSERT_EQ(baked->pages.size(), 1u);
  ASSERT_EQ(baked->pages[0].size(), 4u);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      std::vector<Vec3> maps;
      for (const Image& map : baked->pages[0]) maps.push_back(map.rgb(x, y));
      // 1024 stratified samples of an integrand that varies by less than 1 are within 0.002 (four standard deviations
      // of what texels show); averaging neighbours only takes from that.
      EXPECT_NEAR(maps[0].y, 0.5, 0.002);
      EXPECT_NEAR(maps[1].y, 0.0, 0.002);
      EXPECT_NEAR(maps[2].y, 0.0, 0.002);
      EXPECT_NEAR(maps[3].y, 0.5, 0.002);
      for (const Vec3& n : {Vec3(0, 0, 1), Vec3(0.6f, 0, 0.8f), Vec3(0, -0.8f, 0.6f)})
        EXPECT_NEAR(baked->encoding->decode(maps, n).y, (1 + n.z) / 2, 0.004);
    }
  // Signed maps are stored as they are.
  bool anyNegative = false;
  for (const float v : baked->pages[0][1].pixels) anyNegative = anyNegative || v < 0.0f;
  EXPECT_TRUE(anyNegative);
}

TEST_P(EachIntegrator, TheFlatMapAloneIsTheFlatMap) {
  const TestScene test = squareUnderSky(GetParam());
  const BakeOptions options{.samples = 16, .encoding = flatEncoding()};
  const BakeResult result = test.bake(options);
  ASSERT_EQ(result.pages[0].maps.size(), 1u);
  EXPECT_EQ(result.pages[0].maps[0].pixels, result.pages[0].flat.pixels);
  const auto baked = bakeToFilesAndBack(test, options);
  ASSERT_TRUE(baked) << baked.error().message;
  ASSERT_EQ(baked->pages[0].size(), 1u);
  EXPECT_FALSE(std::filesystem::exists(scratch() / "lightmap-0-rnm0.exr"));
  const Vec3 light = baked->pages[0][0].rgb(3, 3);
  EXPECT_EQ(baked->encoding->decode(std::span(&light, 1), Vec3(0.6f, 0, 0.8f)), light);
}

// Rays are sent without regard to the maps that they are summed up in. (Where texels stop by themselves, the worst map
// decides.)
TEST_P(EachIntegrator, TheFlatMapDoesNotDependOnTheEncoding) {
  TestScene test = busyRoom();
  test.integrator = GetParam();
  const BakeResult one = test.bake({.samples = 16, .adaptive = false});
  const BakeResult other = test.bake({.samples = 16, .adaptive = false, .encoding = sh1Encoding()});
  EXPECT_EQ(one.stats.rays, other.stats.rays);
  ASSERT_EQ(one.pages.size(), other.pages.size());
  for (std::size_t p = 0; p < one.pages.size(); ++p) {
    EXPECT_EQ(one.pages[p].flat.pixels, other.pages[p].flat.pixels);
    EXPECT_EQ(one.pages[p].aux.pixels, other.pages[p].aux.pixels);
  }
}

INSTANTIATE_TEST_SUITE_P(EncodingBake, EachIntegrator, testing::Values(Integrator::Path, Integrator::Gather),
                         [](const auto& of) { return of.param == Integrator::Path ? "Path" : "Gather"; });

}  // namespace
}  // namespace lumel
