// Places that share no light: each must be as good as if it were alone, however bright the others are.
#include <gtest/gtest.h>

#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr float kAlbedo = 0.8f;
constexpr int kWalls = 6;

/// A closed room of 2 x 2 x 2 m with a lamp of one candela, on the first six pages, under a field of 400 m2 with a sun
/// of so many lux.
TestScene cellar(float lux) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int wall = test.addMaterial(Vec3(kAlbedo));
  test.addRoom({0, 0, 0}, {2, 2, 2}, {.material = wall, .texels = 8});
  test.addRectangle({-9, 2.5f, 11}, {20, 0, 0}, {0, 0, -20}, {.material = wall, .texels = 32});
  Light lamp, sun;
  lamp.position = {1, 1, 1};
  lamp.intensity = 1.0f;
  test.scene.lights.push_back(lamp);
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(0.3f, -1.0f, 0.2f));
  sun.intensity = lux;
  if (lux > 0.0f) test.scene.lights.push_back(sun);
  return test;
}

/// Mean irradiance / pi over the room.
double lightOfRoom(const TestScene& test) {
  const BakeResult result = test.bake({.samples = 256, .adaptive = false});
  double sum = 0.0, count = 0.0;
  for (std::size_t page = 0; page < kWalls; ++page) {
    const auto& flat = result.pages[page].flat;
    for (int y = 0; y < flat.height; ++y)
      for (int x = 0; x < flat.width; ++x, ++count) sum += static_cast<double>(luminance(flat.rgb(x, y)));
  }
  return sum / count;
}

TEST(SeparatePlaces, TheSunAboveChangesNothingInACellar) {
  const double without = lightOfRoom(cellar(0.0f));
  const double with = lightOfRoom(cellar(1e6f));
  // A flux of 4 pi lm on 24 m2 that keep 1 - albedo of it; 2% for the cache, which takes light for constant over a
  // texel, in corners too.
  EXPECT_NEAR(without * 24.0 * (1.0 - static_cast<double>(kAlbedo)) / 4.0, 1.0, 0.02);
  // The rays are the same. Light samples towards the hidden sun are lost: that leaves a noise of 5% or less at each of
  // 384 texels, of 0.3% in the mean.
  EXPECT_NEAR(with / without, 1.0, 0.01);
}

}  // namespace
}  // namespace lumel
