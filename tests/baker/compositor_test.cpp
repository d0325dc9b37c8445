// Stills and the viewpoint for scenes without a camera.
#include <gtest/gtest.h>

#include <map>

#include "baker/stills/viewpoint.h"
#include "test_scene.h"

namespace lumel {
namespace {

using testing_scene::TestScene;

BakedScene litEvenly(TestScene test) {
  BakedScene baked;
  baked.scene = std::move(test.scene);
  baked.meanFlat = Vec3(1.0f);  // what a primitive without a page is lit by
  return baked;
}

Compositor compositorOf(const BakedScene& baked) {
  auto made = Compositor::make(baked);
  EXPECT_TRUE(made) << made.error().message;
  return *std::move(made);
}

TEST(Compositor, FineStripesFarAwayAreGreyWithOneRay) {
  TestScene test;
  std::vector<Vec4> stripes;
  for (int i = 0; i < 256 * 256; ++i) stripes.push_back(i % 2 == 0 ? Vec4(1.0f) : Vec4(0, 0, 0, 1));
  const int material = test.addMaterial(Vec3(1.0f));
  test.scene.materials.back().baseColorMap.image = test.addImage(256, 256, stripes);
  test.scene.materials.back().baseColorMap.nearest = true;
  test.addRectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, {.material = material, .texels = 0});
  const BakedScene baked = litEvenly(std::move(test));
  const Compositor compositor = compositorOf(baked);
  RenderOptions options;
  options.width = options.height = 32;  // 8 texels to a pixel
  options.samplesPerPixel = 1;
  Camera camera = cameraLookingAt({0, 0, 2}, {0, 0, 0}, 2.0f * std::atan(0.5f));
  const auto still = compositor.render(camera, options, noProgress());
  ASSERT_TRUE(still);
  const float grey = still->radiance.at(16, 16)[0];
  EXPECT_NEAR(grey, 0.5f, 0.01f);  // 8 bits of sRGB
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) ASSERT_NEAR(still->radiance.at(x, y)[0], grey, 0.0065f);  // a step of 8 bits
  // An orthographic picture of the same, and a look from so near that texels show.
  camera.orthographic = true;
  camera.yExtent = 1.0f;
  EXPECT_NEAR(compositor.render(camera, options, noProgress())->radiance.at(5, 5)[0], grey, 0.01f);
  camera = cameraLookingAt({0, 0, 0.01f}, {0, 0, 0}, 1.0f);
  const auto near = compositor.render(camera, options, noProgress());
  ASSERT_TRUE(near);
  for (int x = 0; x < 32; ++x) {
    const float value = near->radiance.at(x, 7)[0];
    EXPECT_TRUE(value == 0.0f || value == 1.0f) << value;
  }
}

TEST(Shading, EveryModeShowsWhatItsNameSays) {
  TestScene test;
  const Vec3 albedo(0.5f, 0.25f, 0.125f), emission(0.25f, 0.0f, 1.0f), sky(2.0f);
  test.addRectangle({-1, -1, 0}, {2, 0, 0}, {0, 1, 0}, {.material = test.addMaterial(albedo, emission), .texels = 0});
  test.scene.environment.color = sky;
  const BakedScene baked = litEvenly(std::move(test));
  const Compositor compositor = compositorOf(baked);
  struct Expectation {
    Vec3 below;  // where the rectangle is
    Vec3 above;  // where nothing is
    Shown shown;
  };
  const std::map<std::string, Expectation> expected = {{"lit", {albedo + emission, sky, Shown::Light}},
                                                       {"lightmap", {Vec3(1.0f), Vec3(0.0f), Shown::Light}},
                                                       {"albedo", {albedo, Vec3(0.0f), Shown::Color}},
                                                       {"normal", {Vec3(0.5f, 0.5f, 1.0f), Vec3(0.0f), Shown::Data}}};
  EXPECT_EQ(shadings().size(), expected.size());
  for (const Shading& shading : shadings()) {
    const auto found = expected.find(std::string(shading.name));
    ASSERT_NE(found, expected.end()) << shading.name << " is not tested";
    const RenderOptions options{.width = 8, .height = 8, .samplesPerPixel = 1, .shading = &shading};
    const auto still = compositor.render(cameraLookingAt({0, 0, 2}, {0, 0, 0}, 0.5f), options, noProgress());
    ASSERT_TRUE(still);
    for (int c = 0; c < 3; ++c) {
      EXPECT_FLOAT_EQ(still->radiance.at(4, 6)[c], found->second.below[c]) << shading.name;
      EXPECT_FLOAT_EQ(still->radiance.at(4, 1)[c], found->second.above[c]) << shading.name;
    }
    EXPECT_EQ(shading.shown, found->second.shown) << shading.name;
    EXPECT_NE(describeShadings().find(shading.shows), std::string::npos);
  }
}

/// Where the picture, from -1 to 1 both ways, shows a point.
Vec2 inPicture(const Camera& camera, const Vec3& point, float aspect) {
  const Vec3 p(glm::inverse(camera.worldFromCamera) * Vec4(point, 1.0f));
  EXPECT_LT(p.z, 0.0f);
  return Vec2(p.x / aspect, p.y) / (-p.z * std::tan(0.5f * camera.yFov));
}

void expectThingShownWhole(bool doubleSided) {
  TestScene test;
  test.scene.materials[0].doubleSided = doubleSided;
  const Vec3 least(10, 2, -3), most(13, 3, -1);
  // A box whose fronts face outwards: the room turned inside out.
  test.addRectangle({least.x, least.y, most.z}, {3, 0, 0}, {0, 1, 0}, {.texels = 0});
  test.addRectangle({most.x, least.y, least.z}, {-3, 0, 0}, {0, 1, 0}, {.texels = 0});
  test.addRectangle({most.x, least.y, most.z}, {0, 0, -2}, {0, 1, 0}, {.texels = 0});
  test.addRectangle({least.x, least.y, least.z}, {0, 0, 2}, {0, 1, 0}, {.texels = 0});
  test.addRectangle({least.x, most.y, most.z}, {3, 0, 0}, {0, 0, -2}, {.texels = 0});
  test.addRectangle({least.x, least.y, least.z}, {3, 0, 0}, {0, 0, 2}, {.texels = 0});
  const BakedScene baked = litEvenly(std::move(test));
  for (float aspect : {1.7f, 0.5f}) {
    const Camera camera = chooseViewpoint(compositorOf(baked), aspect);
    float widest = 0.0f;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 point(corner & 1 ? least.x : most.x, corner & 2 ? least.y : most.y, corner & 4 ? least.z : most.z);
      const Vec2 at = glm::abs(inPicture(camera, point, aspect));
      widest = std::max({widest, at.x, at.y});
    }
    EXPECT_LT(widest, 1.0f);
    EXPECT_GT(widest, 0.9f);  // and fills the picture
  }
}

TEST(Viewpoint, ShowsAThingInTheOpenWhole) {
  expectThingShownWhole(false);
  expectThingShownWhole(true);
}

TEST(Viewpoint, StaysInsideAClosedRoom) {
  TestScene test;
  test.scene.materials[0].doubleSided = true;
  test.addRoom({0, 0, 0}, {6, 3, 4}, {.texels = 0});
  const BakedScene baked = litEvenly(std::move(test));
  const Vec3 eye(chooseViewpoint(compositorOf(baked), 1.7f).worldFromCamera[3]);
  EXPECT_TRUE(eye.x > 0 && eye.x < 6 && eye.y > 0 && eye.y < 3 && eye.z > 0 && eye.z < 4);
}

}  // namespace
}  // namespace lumel
