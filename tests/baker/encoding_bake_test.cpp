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

std::shared_ptr<const Encoding> allTogether() {
  std::vector<std::shared_ptr<const Encoding>> all;
  for (const EncodingSummary& summary : encodingSummaries()) all.push_back(*findEncoding(summary.name, {}));
  return *jointEncoding(all);
}

// An even sky in closed form (lightmap/encoding_test), sampled: each encoding's mean over the texels is within three
// standard errors of it, by how far texels differ, and these are small enough to tell.
TEST_P(EachIntegrator, AnEvenSkyInAllEncodingsAtOnce) {
  const auto joint = allTogether();
  const TestScene test = squareUnderSky(GetParam());
  const BakeResult result = test.bake({.samples = 256, .adaptive = false, .encoding = joint});
  for (const StoredEncoding& stored : joint->stored())
    for (const Vec3& n : {Vec3(0, 0, 1), Vec3(0.5f, 0, 0.8660254f), Vec3(0, -0.8f, 0.6f)}) {
      const std::string& name = stored.encoding->name();
      double expected = (1 + static_cast<double>(n.z)) / 2;
      if (name == "flat" || name == "rnm") expected = 1.0;
      if (name == "dominant") expected = (0.5 + 0.25 * static_cast<double>(n.z)) / 0.75;
      double sum = 0, square = 0;
      constexpr int kTexels = 64;
      for (int i = 0; i < kTexels; ++i) {
        std::vector<Vec3> sampled;
        for (const Image& map : result.pages[0].maps) sampled.push_back(map.rgb(i % 8, i / 8));
        const auto light =
            static_cast<double>(decodeSampled(stored, sampled, result.pages[0].flat.rgb(i % 8, i / 8), n).y);
        sum += light;
        square += light * light;
      }
      const double mean = sum / kTexels;
      const double error = std::sqrt(std::max(0.0, square / kTexels - mean * mean) / kTexels);
      // Directions of noise have a length: what is made of them leans by its square, (1/16)^2 of a relative deviation.
      EXPECT_NEAR(mean, expected, 3 * error + 5e-4) << name << ' ' << n.x << ' ' << n.y;
      EXPECT_LT(error, 0.01) << name;
    }
}

// Suns are sampled without noise: the first rounding of floats is all that is left.
TEST_P(EachIntegrator, SunsInAllEncodingsAtOnce) {
  for (const float degrees : {0.0f, 45.0f, 80.0f}) {
    const auto joint = allTogether();
    TestScene test = squareUnderSky(GetParam());
    test.scene.environment.color = Vec3(0.0f);
    const float angle = degrees * kPi / 180.0f;
    // The square lies in the plane y = 0, its tangent along x: the sun leans along it.
    Light sun;
    sun.type = LightType::Directional;
    sun.direction = -Vec3(std::sin(angle), std::cos(angle), 0.0f);
    sun.intensity = kPi;
    test.scene.lights.push_back(sun);
    const BakeResult result = test.bake({.samples = 8, .bounces = 0, .encoding = joint});
    std::vector<Vec3> sampled;
    for (const Image& map : result.pages[0].maps) sampled.push_back(map.rgb(4, 4));
    const Vec3 flat = result.pages[0].flat.rgb(4, 4);
    const auto x = static_cast<double>(std::sin(angle)), z = static_cast<double>(std::cos(angle));
    const Vec3 n(0.5f, 0.0f, 0.8660254f);
    const double along = 0.5 * x + 0.8660254 * z;
    for (const StoredEncoding& stored : joint->stored()) {
      const std::string& name = stored.encoding->name();
      const auto light = static_cast<double>(decodeSampled(stored, sampled, flat, n).y);
      if (name == "flat") {
        EXPECT_NEAR(light, z, 1e-5);
      }
      if (name == "sh1") {
        EXPECT_NEAR(light, 0.25 + 0.25 * x + 0.8660254 * (z - 0.25), 1e-5);
      }
      if (name == "ahd") {
        EXPECT_NEAR(light, along, 1e-5);
      }
      if (name == "dominant") {
        EXPECT_NEAR(light, z * (1 + along) / (1 + z), 1e-5);
      }
    }
  }
}

// Directions are made last: of denoised, filled and dilated sums, and have unit length on every texel.
TEST_P(EachIntegrator, DirectionsHaveUnitLengthWhereverTheyAreStored) {
  const auto joint = *jointEncoding({rnmEncoding(), *findEncoding("ahd", {}), *findEncoding("dominant", {})});
  TestScene test = busyRoom();
  test.integrator = GetParam();
  BakeResult result = test.bake({.samples = 16, .encoding = joint});
  finishPages(result.pages, test.atlas, findTexels(test.atlas),
              {.denoise = true, .rings = 1, .groups = joint->groups()});
  encodePages(result.pages, *joint);
  for (const BakedPage& page : result.pages) {
    ASSERT_EQ(page.maps.size(), 3u + 3u + 1u);  // rnm, ahd, and dominant's direction beside the flat map
    for (int y = 0; y < page.flat.height; ++y)
      for (int x = 0; x < page.flat.width; ++x) {
        const Vec3 highlight = 2.0f * page.maps[5].rgb(x, y) - 1.0f, dominant = 2.0f * page.maps[6].rgb(x, y) - 1.0f;
        EXPECT_NEAR(glm::length(highlight), 1.0f, 1e-5f);
        EXPECT_LE(glm::length(dominant), 1.0f + 1e-5f);
        EXPECT_GE(highlight.z, -1e-6f);
        const Vec3 ambient = page.maps[3].rgb(x, y), light = page.maps[4].rgb(x, y), flat = page.flat.rgb(x, y);
        for (int c = 0; c < 3; ++c) {
          EXPECT_GE(ambient[c], 0.0f);
          EXPECT_GE(light[c], 0.0f);
          EXPECT_NEAR(ambient[c] + light[c] * highlight.z, flat[c], 1e-4f * flat[c]);  // rounding of the division
        }
      }
  }
}

// What is stored first is the same alone and in a list.
TEST_P(EachIntegrator, MoreEncodingsChangeNothingOfTheFirst) {
  TestScene test = busyRoom();
  test.integrator = GetParam();
  const auto bakeIn = [&](const std::shared_ptr<const Encoding>& encoding) {
    BakeResult result = test.bake({.samples = 16, .adaptive = false, .encoding = encoding});
    finishPages(result.pages, test.atlas, findTexels(test.atlas),
                {.denoise = true, .rings = 1, .groups = encoding->groups()});
    encodePages(result.pages, *encoding);
    return result;
  };
  const BakeResult alone = bakeIn(rnmEncoding()), all = bakeIn(allTogether());
  for (std::size_t p = 0; p < alone.pages.size(); ++p) {
    EXPECT_EQ(alone.pages[p].flat.pixels, all.pages[p].flat.pixels);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(alone.pages[p].maps[k].pixels, all.pages[p].maps[k].pixels);
  }
}

INSTANTIATE_TEST_SUITE_P(EncodingBake, EachIntegrator, testing::Values(Integrator::Path, Integrator::Gather),
                         [](const auto& of) { return of.param == Integrator::Path ? "Path" : "Gather"; });

}  // namespace
}  // namespace lumel
