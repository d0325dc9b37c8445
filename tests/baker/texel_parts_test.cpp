// Texels that lie in two places: which part counts, and that no light of one place reaches the other.
#include "baker/rays/texel_parts.h"

#include <gtest/gtest.h>

#include "baker/light/lit_scene.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr Vec3 kUp(0, 1, 0);

/// A floor from (-1, 0, -1) to (1, 0, 1) of 4 x 4 texels.
TestScene floorAlone() {
  TestScene test;
  test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.texels = 4});
  return test;
}

struct Parts {
  explicit Parts(const TestScene& test)
      : scene(test), lit(*LitScene::build(scene.scene, true)), pages(findTexels(scene.atlas)) {}
  TexelParts ofPage(std::size_t page) const {
    return {lit->transport().rays, lit->transport().materials, scene.atlas, pages[page]};
  }
  /// The texel of page 0 with these coordinates.
  std::uint32_t texel(int x, int y) const {
    const auto& coords = pages[0].coords;
    for (std::uint32_t i = 0; i < coords.size(); ++i)
      if (coords[i].x == x && coords[i].y == y) return i;
    ADD_FAILURE() << "no texel " << x << ", " << y;
    return 0;
  }
  TestScene scene;
  std::unique_ptr<LitScene> lit;
  std::vector<PageTexels> pages;
};

TEST(TexelParts, AWallDividesTheTexelsThatItCrosses) {
  TestScene test = floorAlone();
  // Through the texels of column 2, which reach from x = 0 to 0.5.
  test.addRectangle({0.1f, 0, 2}, {0, 0, -4}, {0, 1, 0}, {.texels = 0});
  const Parts parts(test);
  const TexelParts page = parts.ofPage(0);
  for (int x = 0; x < 4; ++x) {
    const std::array<std::uint32_t, 1> texel = {parts.texel(x, 1)};
    EXPECT_EQ(page.suspects(texel), x == 2 ? 1u : 0u) << x;
    EXPECT_EQ(page.find(texel[0]).has_value(), x == 2) << x;
  }
  // The larger part, from which more of the texels around are seen, counts.
  const auto part = page.find(parts.texel(2, 1));
  ASSERT_TRUE(part);
  const std::array<SurfaceSpot, 3> spots = {SurfaceSpot{{0.3f, 0, 0.25f}, kUp}, SurfaceSpot{{0.05f, 0, 0.25f}, kUp},
                                            SurfaceSpot{{0.12f, 0, 0.4f}, kUp}};
  EXPECT_EQ(page.members(*part, spots), 0b101u);
}

TEST(TexelParts, WhatCanBeWalkedRoundDividesNothing) {
  TestScene test = floorAlone();
  // A post of 4 cm amid the texel from (0, 0) to (0.5, 0.5), and a step that is lower than a twentieth of a texel.
  for (const float side : {0.0f, 1.0f}) {
    test.addRectangle({0.23f + 0.04f * side, 0, 0.23f}, {0, 0, 0.04f}, {0, 1, 0}, {.texels = 0});
    test.addRectangle({0.23f, 0, 0.23f + 0.04f * side}, {0.04f, 0, 0}, {0, 1, 0}, {.texels = 0});
  }
  test.addRectangle({-0.6f, 0, 2}, {0, 0, -4}, {0, 0.01f, 0}, {.texels = 0});
  const Parts parts(test);
  const TexelParts page = parts.ofPage(0);
  // What lies within the post is a part of its own, and all around it is one.
  const std::array<SurfaceSpot, 5> around = {SurfaceSpot{{0.05f, 0, 0.25f}, kUp}, SurfaceSpot{{0.45f, 0, 0.25f}, kUp},
                                             SurfaceSpot{{0.25f, 0, 0.05f}, kUp}, SurfaceSpot{{0.25f, 0, 0.45f}, kUp},
                                             SurfaceSpot{{0.25f, 0, 0.25f}, kUp}};
  const auto part = page.find(parts.texel(2, 2));
  ASSERT_TRUE(part);
  EXPECT_EQ(page.members(*part, around), 0b01111u);
  for (std::uint32_t texel = 0; texel < parts.pages[0].size(); ++texel)
    EXPECT_EQ(page.find(texel).has_value(), texel == parts.texel(2, 2)) << texel;
}

TEST(TexelParts, WhatLetsLightThroughDividesNothing) {
  TestScene test = floorAlone();
  const int pane = test.addMaterial(Vec3(0.5f));
  Material& material = test.scene.materials[static_cast<std::size_t>(pane)];
  material.alphaMode = AlphaMode::Blend;
  material.baseColor.w = 0.9f;
  test.addRectangle({0.1f, 0, 2}, {0, 0, -4}, {0, 1, 0}, {.material = pane, .texels = 0});
  const Parts parts(test);
  EXPECT_FALSE(parts.ofPage(0).find(parts.texel(2, 1)));
}

// A closed room whose floor passes 2 cm under its walls, under a sky of 1: nothing inside is lit, although a twelfth of
// each border texel lies in the open.
TEST(TexelParts, AClosedRoomIsDark) {
  for (const Integrator integrator : {Integrator::Gather, Integrator::Path}) {
    TestScene test;
    test.integrator = integrator;
    const int grey = test.addMaterial(Vec3(0.7f));
    test.addRectangle({-1.02f, 0, 1.02f}, {2.04f, 0, 0}, {0, 0, -2.04f}, {.material = grey, .texels = 8});
    // Walls that pass the floor and the ceiling, and a ceiling that passes the walls.
    const RectangleOptions wall{.material = grey, .texels = 0};
    test.addRectangle({-1, -0.1f, 1.1f}, {0, 0, -2.2f}, {0, 2.2f, 0}, wall);
    test.addRectangle({1, -0.1f, -1.1f}, {0, 0, 2.2f}, {0, 2.2f, 0}, wall);
    test.addRectangle({-1.1f, -0.1f, -1}, {2.2f, 0, 0}, {0, 2.2f, 0}, wall);
    test.addRectangle({1.1f, -0.1f, 1}, {-2.2f, 0, 0}, {0, 2.2f, 0}, wall);
    test.addRectangle({-1.1f, 2, -1.1f}, {2.2f, 0, 0}, {0, 0, 2.2f}, wall);
    test.scene.environment.color = Vec3(1.0f);
    const BakeResult baked = test.bake({.samples = 64});
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x)
        EXPECT_EQ(baked.pages[0].flat.rgb(x, y), Vec3(0.0f)) << nameOf(integrator) << " " << x << ", " << y;
  }
}

}  // namespace
}  // namespace lumel
