// Seams in finished bakes: tiles under an even sky in closed form, and a wall that stands on a seam.
#include <gtest/gtest.h>

#include <numbers>

#include "baker/bake/finish.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr int kTexels = 12;

/// Puts a page's tile in the middle of a page with two empty texels around, so that there is room for what lies beyond.
void addGutter(TestScene& test) {
  constexpr float kGutter = 2.0f;
  constexpr auto kPage = static_cast<float>(kTexels);
  for (Surface& surface : test.atlas.surfaces)
    for (Vec2& uv : surface.lightmapUvs) uv = (uv * kPage + kGutter) / (kPage + 2.0f * kGutter);
  for (Page& page : test.atlas.pages) page = {kTexels + 4, kTexels + 4};
}

/// Two black tiles of 1 m side by side at x = 1.
TestScene twoTiles() {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int black = test.addMaterial(Vec3(0.0f));
  for (const float x : {0.0f, 1.0f})
    test.addRectangle({x, 0, 0}, {1, 0, 0}, {0, 0, -1}, {.material = black, .texels = kTexels});
  return test;
}

SeamFigures finish(const TestScene& test, BakeResult& baked) {
  return finishPages(baked.pages, test.atlas, findTexels(test.atlas),
                     {.denoise = true, .rings = 1, .seams = &baked.seams});
}

TEST(SeamsOfBakes, TilesUnderAnEvenSkyAreOne) {
  TestScene test = twoTiles();
  addGutter(test);
  test.scene.environment.color = Vec3(1.0f);
  BakeResult baked = test.bake({.samples = 64, .seams = true});
  const SeamFigures figures = finish(test, baked);
  EXPECT_NEAR(figures.texels, kTexels, 1e-3);
  EXPECT_LT(figures.after.most, 1e-4);
  // Nothing is in the sky's way: irradiance / pi is 1, up to what 64 samples of a mixture of two densities leave.
  for (const BakedPage& page : baked.pages)
    for (int y = 2; y < kTexels + 2; ++y)
      for (int x = 1; x < kTexels + 3; ++x) EXPECT_NEAR(page.flat.rgb(x, y).x, 1.0f, 0.01f) << x << ", " << y;
}

// Each encoding's seams are mended beside the flat map as they would be alone.
TEST(SeamsOfBakes, AreMendedInSeveralEncodings) {
  TestScene test = twoTiles();
  addGutter(test);
  test.scene.environment.color = Vec3(1.0f, 0.5f, 0.25f);
  const auto bakeIn = [&](const std::shared_ptr<const Encoding>& encoding) {
    BakeResult baked = test.bake({.samples = 16, .adaptive = false, .seams = true, .encoding = encoding});
    finishPages(baked.pages, test.atlas, findTexels(test.atlas),
                {.rings = 1, .seams = &baked.seams, .groups = encoding->groups()});
    return baked;
  };
  const BakeResult rnm = bakeIn(rnmEncoding()), sh1 = bakeIn(sh1Encoding());
  const BakeResult both = bakeIn(*jointEncoding({rnmEncoding(), sh1Encoding()}));
  for (std::size_t p = 0; p < both.pages.size(); ++p) {
    ASSERT_EQ(both.pages[p].maps.size(), 7u);
    EXPECT_EQ(both.pages[p].flat.pixels, rnm.pages[p].flat.pixels);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(both.pages[p].maps[k].pixels, rnm.pages[p].maps[k].pixels);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(both.pages[p].maps[3 + k].pixels, sh1.pages[p].maps[k].pixels);
  }
}

TEST(SeamsOfBakes, AWallOnTheSeamKeepsItsShadow) {
  for (const bool standing : {true, false}) {
    TestScene test = twoTiles();
    // It reaches over all of the seam; without it the first tile is as bright as the second.
    if (standing) {
      test.addMaterial(Vec3(0.0f));
      test.scene.materials.back().doubleSided = true;
      test.addRectangle({1, 0, 1}, {0, 0, -3}, {0, 2, 0}, {.material = 2, .texels = 0});
    }
    addGutter(test);
    // Sun from +x at 45 degrees: irradiance / pi on the floor is 1.
    Light sun;
    sun.type = LightType::Directional;
    sun.intensity = std::numbers::pi_v<float> * std::numbers::sqrt2_v<float>;
    sun.direction = glm::normalize(Vec3(-1, -1, 0));
    test.scene.lights.push_back(sun);
    BakeResult baked = test.bake({.samples = 64, .seams = true});
    const SeamFigures figures = finish(test, baked);
    EXPECT_EQ(figures.points, standing ? 0u : 2u * kTexels);
    for (int y = 2; y < kTexels + 2; ++y) {
      EXPECT_NEAR(baked.pages[0].flat.rgb(kTexels + 1, y).x, standing ? 0.0f : 1.0f, 1e-4f);
      EXPECT_NEAR(baked.pages[1].flat.rgb(2, y).x, 1.0f, 1e-4f);
    }
  }
}

TEST(SeamsOfBakes, AreTheSameForAnyNumberOfThreads) {
  TestScene test = twoTiles();
  test.addRectangle({0.3f, 0.3f, -0.4f}, {0, 0, 0.3f}, {0.9f, 0, 0}, {.material = 1, .texels = 0});  // its shade
  addGutter(test);
  test.scene.environment.color = Vec3(1.0f);
  std::vector<BakeResult> bakes;
  for (const int threads : {1, 4}) {
    bakes.push_back(test.bake({.samples = 16, .seams = true}, threads));
    EXPECT_EQ(finish(test, bakes.back()).points, 2u * kTexels);
  }
  EXPECT_TRUE(sameBytes(bakes[0], bakes[1]));
}

}  // namespace
}  // namespace lumel
