// Stills and the viewpoint for scenes without a camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "baker/stills/label.h"
#include "baker/stills/lamps.h"
#include "baker/stills/placed_object.h"
#include "baker/stills/sheet.h"
#include "baker/stills/viewpoint.h"
#include "ssbump/maps/weights.h"
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

// A model that is placed into the left half of a volume takes its light, one outside of it the mean of the bake.
TEST(Compositor, PlacedObjectsStandInTheLightOfTheirVolume) {
  TestScene level, model;
  level.addRectangle({-4, -1, -1}, {8, 0, 0}, {0, 2, 0}, {.texels = 0});
  const int red = model.addMaterial({0.5f, 0.0f, 0.0f});
  model.addRectangle({-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}, {.material = red, .texels = 0});
  const auto lightAt = [&](const Vec3& at) {
    BakedScene baked = litEvenly(level);
    LightVolume volume = volumeOf(Vec3(-4, -1, -0.5f), Vec3(0, 1, 1), 1.0f);
    for (VolumePoint& point : volume.points) {
      point.isValid = true;
      point.harmonics[0] = Vec3(4.0f / 0.28209479f);  // radiance 4 from everywhere
    }
    baked.volumes = {volume};
    placeObject(baked.scene, model.scene, at);
    const Compositor compositor = compositorOf(baked);
    RenderOptions options;
    options.width = options.height = 3;
    options.samplesPerPixel = 1;
    const auto still = compositor.render(cameraLookingAt(at + Vec3(0, 0, 1), at, 0.5f), options, noProgress());
    EXPECT_TRUE(still);
    return still->radiance.rgb(1, 1);
  };
  EXPECT_LT(glm::length(lightAt({-2, 0, 0}) - Vec3(2.0f, 0.0f, 0.0f)), 1e-5f);
  EXPECT_LT(glm::length(lightAt({2, 0, 0}) - Vec3(0.5f, 0.0f, 0.0f)), 1e-5f);
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

const Vec3 kAlbedo(0.5f, 0.25f, 0.125f), kEmission(0.25f, 0.0f, 1.0f), kSky(2.0f);
const Vec3 kWeights(51.0f / 255.0f, 102.0f / 255.0f, 51.0f / 255.0f);

/// A rectangle of 2 x 1 m below the horizon of the picture, on a page of 4 x 4 texels that are all alike, with an
/// ssbump map of kWeights; a sky of kSky behind it.
BakedScene bumpedRectangle() {
  TestScene test;
  const int material = test.addMaterial(kAlbedo, kEmission);
  test.scene.materials.back().ssbumpMap.image = test.addImage(1, 1, {Vec4(kWeights, 1.0f)});
  test.addRectangle({-1, -1, 0}, {2, 0, 0}, {0, 1, 0}, {.material = material, .texels = 0});
  Primitive& primitive = test.scene.meshes.back().primitives.front();
  primitive.uvSets.assign(2, {});
  for (const Vec3& position : primitive.positions)
    for (std::vector<Vec2>& set : primitive.uvSets) set.emplace_back(0.5f * position.x + 0.5f, -position.y);
  primitive.tangents.assign(primitive.positions.size(), Vec4(1, 0, 0, 1));
  primitive.lightmapPage = 0;
  test.scene.environment.color = kSky;
  BakedScene baked;
  baked.scene = std::move(test.scene);
  baked.pages = {{Image(4, 4, 3, 0.2f), Image(4, 4, 3, 0.4f), Image(4, 4, 3, 0.8f)}};
  baked.flat = {Image(4, 4, 3, 0.5f)};
  baked.auxChannels = {"coverage", "validity", "stderr", "samples"};
  baked.aux = {Image(4, 4, 4)};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      const float values[] = {0.75f, 0.5f, 0.01f, 64.0f};
      std::copy_n(values, 4, baked.aux[0].at(x, y));
    }
  return baked;
}

Vec3 shown(const Compositor& compositor, const Shading& shading, int row, const std::vector<Light>& lamps = {}) {
  RenderOptions options{.width = 8, .height = 8, .samplesPerPixel = 1, .shading = &shading};
  options.lamps = lamps;
  const auto still = compositor.render(cameraLookingAt({0, 0, 2}, {0, 0, 0}, 0.5f), options, noProgress());
  EXPECT_TRUE(still);
  return still ? still->radiance.rgb(4, row) : Vec3(-1.0f);
}

/// Values by hand: the recovered normal has (n.B_i)^2 = s_i / sum s = (1/4, 1/2, 1/4), sum s = 0.8.
TEST(Shading, EveryModeShowsWhatItsNameSays) {
  const BakedScene baked = bumpedRectangle();
  const Compositor compositor = compositorOf(baked);
  const float open = 0.25f * 0.2f + 0.5f * 0.4f + 0.25f * 0.8f, shadowed = 0.8f * open;
  const Vec3 n = ssbump::recoveredNormal(kWeights);
  const auto lit = [](float light) { return kAlbedo * light + kEmission; };
  const std::map<std::string, Vec3> expected = {{"lit", lit(shadowed)},
                                                {"lightmap", Vec3(shadowed)},
                                                {"flat", lit(0.5f)},
                                                {"flat-dot", lit(0.5f * n.z)},
                                                {"normal-mapped", lit(open)},
                                                {"normal-mapped-ao", lit(0.8f * open)},
                                                {"ssbump", lit(shadowed)},
                                                {"ssbump-open", lit(open)},
                                                {"basis0", Vec3(0.2f)},
                                                {"basis1", Vec3(0.4f)},
                                                {"basis2", Vec3(0.8f)},
                                                {"masked0", Vec3(0.2f * kWeights.x)},
                                                {"masked1", Vec3(0.4f * kWeights.y)},
                                                {"masked2", Vec3(0.8f * kWeights.z)},
                                                {"ssbump-channels", 1.5f * kWeights},
                                                {"recovered", n * 0.5f + 0.5f},
                                                {"recovered-world", n * 0.5f + 0.5f},
                                                {"reflection", kSky},
                                                {"reflection-plain", kSky},
                                                {"albedo", kAlbedo},
                                                {"normal", n * 0.5f + 0.5f},
                                                {"density", Vec3(4.0f / std::sqrt(2.0f))},
                                                {"coverage", Vec3(0.75f)},
                                                {"validity", Vec3(0.5f)},
                                                {"error", Vec3(2.0f)},
                                                {"samples", Vec3(64.0f)}};
  for (const Shading& shading : shadings()) {
    EXPECT_EQ(findShading(shading.name), &shading);
    EXPECT_NE(describeShadings().find(shading.shows), std::string::npos);
    const Vec3 below = shown(compositor, shading, 6), above = shown(compositor, shading, 1);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(above[c], shading.hasSky ? kSky[c] : 0.0f) << shading.name;
    if (shading.name == "checker" || shading.name == "chart" || shading.name == "page") {
      EXPECT_GT(below.x + below.y + below.z, 0.1f) << shading.name;
      continue;
    }
    const auto found = expected.find(std::string(shading.name));
    ASSERT_NE(found, expected.end()) << shading.name << " is not tested";
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(below[c], found->second[c], 1e-5f) << shading.name;  // some float roundings
  }
  EXPECT_EQ(findShading("nothing"), nullptr);
}

/// A sun straight on brings E / pi to a plain surface; by weights it is E / pi times 3 sum s_i (1/3), by the normal
/// E / pi n.z. Behind something it brings nothing.
TEST(Shading, LampsShineByWeightsAndByNormalsAndCastShadows) {
  BakedScene baked = bumpedRectangle();
  for (Image& map : baked.pages[0]) map = Image(4, 4, 3);
  baked.flat[0] = Image(4, 4, 3);
  const Camera camera = cameraLookingAt({0, 0, 2}, {0, 0, 0}, 0.5f);
  const auto sun = parseLamps("sun:0,0,-1:3", camera);
  ASSERT_TRUE(sun);
  const Vec3 n = ssbump::recoveredNormal(kWeights);
  {
    const Compositor compositor = compositorOf(baked);
    const auto light = [&](const char* mode) {
      return (shown(compositor, *findShading(mode), 6, *sun) - kEmission).x / (kAlbedo.x * 3.0f * kInvPi);
    };
    EXPECT_NEAR(light("flat"), 1.0f, 1e-5f);
    EXPECT_NEAR(light("ssbump"), 0.8f, 1e-5f);
    EXPECT_NEAR(light("ssbump-open"), 1.0f, 1e-5f);
    EXPECT_NEAR(light("normal-mapped"), n.z, 1e-5f);
    // A lamp of 4 candela at 2 m brings one lux.
    const auto lamp = parseLamps("point:0,-0.4,2:4", camera);
    ASSERT_TRUE(lamp);
    EXPECT_NEAR(lampIrradiance((*lamp)[0], {0, -0.4f, 0}).x, 1.0f, 1e-6f);
  }
  Primitive screen = baked.scene.meshes.back().primitives.front();
  for (Vec3& p : screen.positions) p.z += 3.0f;
  screen.lightmapPage = -1;
  baked.scene.meshes.push_back({"screen", {screen}});
  baked.scene.instances.push_back({.name = "screen", .mesh = static_cast<int>(baked.scene.meshes.size()) - 1});
  const Compositor compositor = compositorOf(baked);
  const Vec3 shadow = shown(compositor, *findShading("ssbump"), 6, *sun);
  EXPECT_NEAR(shadow.x, kEmission.x, 1e-6f);
}

TEST(Lamps, TextThatIsNoneIsNamed) {
  const Camera camera = cameraLookingAt({0, 0, 2}, {0, 0, 0}, 0.5f);
  for (const char* text : {"sun", "sun:0,0,0:1", "point:1,2:3", "spot:camera:100", "spot:camera:100:0",
                           "point:0,0,0:-1", "sun:0,0,-1:1:1,1", "lamp:0,0,0:1", "sun:0,0,-1:1;", "point:0,0,0:nan"}) {
    const auto lamps = parseLamps(text, camera);
    ASSERT_FALSE(lamps) << text;
    EXPECT_EQ(lamps.error().kind, ErrorKind::Usage);
  }
  const auto lamps = parseLamps("spot:camera:300:25:1,0.5,0;sun:0,-1,0:2", camera);
  ASSERT_TRUE(lamps);
  ASSERT_EQ(lamps->size(), 2u);
  EXPECT_NEAR((*lamps)[0].direction.z, -1.0f, 1e-6f);
  EXPECT_EQ((*lamps)[0].color.y, 0.5f);
}

TEST(Sheet, PanelsStandBesideEachOtherAndNumbersHaveALegend) {
  const Image sheet = sheetOf({{"one", Image(40, 30, 3, 0.25f)}, {"two", Image(40, 30, 3, 1.0f)}});
  EXPECT_GT(sheet.width, 80);
  EXPECT_GT(sheet.height, 30 + kLabelHeight);
  EXPECT_EQ(sheet.rgb(20, kLabelHeight + 20), Vec3(0.25f));
  EXPECT_EQ(sheet.rgb(70, kLabelHeight + 20), Vec3(1.0f));
  Still still{Image(200, 2, 3), Image(200, 2, 1, 1.0f)};
  for (int x = 0; x < 200; ++x)
    for (int y = 0; y < 2; ++y) still.radiance.setRgb(x, y, Vec3(static_cast<float>(x)));
  still.lit.at(150, 1)[0] = 0.0f;
  const Image picture = numberPicture(still, "rays");
  EXPECT_EQ(picture.height, 2 + kLabelHeight);
  float before = 0.0f;
  for (int x = 10; x < 190; x += 20) {
    const float brightness = luminance(picture.rgb(x, 0));
    EXPECT_GT(brightness, before);
    before = brightness;
  }
  EXPECT_EQ(picture.rgb(150, 1), Vec3(0.4f));  // not known
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
