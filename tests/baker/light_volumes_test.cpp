#include "baker/bake/light_volumes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "baker/bake/gather_session.h"
#include "baker/light/lit_scene.h"
#include "scene/base/parallel.h"
#include "scene/base/sobol.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A baked scene and a volume in it.
struct Level {
  TestScene test;
  std::unique_ptr<LitScene> lit;
  std::vector<PageTexels> texels;
  GatherSession session;

  explicit Level(TestScene scene, const BakeOptions& options = {.samples = 64})
      : test(std::move(scene)), texels(findTexels(test.atlas)) {
    auto built = LitScene::build(test.scene, true);
    EXPECT_TRUE(built);
    lit = *std::move(built);
    session.keepsSurfaces = true;
    EXPECT_TRUE(bake(*lit, test.atlas, texels, options, noProgress(), &session));
  }
  LightVolume volume(const Vec3& least, const Vec3& most, float cell, const VolumeOptions& options = {}) const {
    std::vector<LightVolume> volumes{volumeOf(least, most, cell)};
    EXPECT_TRUE(bakeVolumes(lit->transport(), *session.surfaces, volumes, options, noProgress()));
    return volumes[0];
  }
};

// An even sky of 1 above and below a speck: every face holds 1. Rays and light samples are 4096 each; faces are sums
// over 4096 scrambled Sobol directions, not divided by their own weights.
TEST(LightVolumes, EvenSky) {
  TestScene test;
  test.scene.environment.color = Vec3(1.0f);
  test.addRectangle({100, 100, 100}, {1e-3f, 0, 0}, {0, 1e-3f, 0}, {.texels = 1});
  const LightVolume volume = Level(test).volume(Vec3(0.0f), Vec3(1.0f), 1.0f, {.samples = 16384});
  for (const VolumePoint& point : volume.points) {
    EXPECT_TRUE(point.isValid);
    for (const Vec3& face : point.cube) EXPECT_NEAR(face.x, 1.0f, 1e-3f);
    EXPECT_NEAR(point.harmonics[0].x * 0.28209479f, 1.0f, 1e-4f);
  }
}

// A point light of intensity 1 is not sampled but known: irradiance on faces is cos / d^2.
TEST(LightVolumes, PointLight) {
  TestScene test;
  Light lamp;
  lamp.type = LightType::Point;
  lamp.color = Vec3(1.0f);
  lamp.position = {0.5f, 2.0f, 0.25f};
  test.scene.lights.push_back(lamp);
  test.addRectangle({100, 100, 100}, {1e-3f, 0, 0}, {0, 1e-3f, 0}, {.texels = 1});
  const LightVolume volume = Level(test).volume(Vec3(0.0f), Vec3(1.0f), 0.5f);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const Vec3 way = lamp.position - volume.gridPoint(i);
    const Vec3 facing = way / (kPi * std::pow(glm::length(way), 3.0f));
    for (int axis = 0; axis < 3; ++axis)
      for (const int back : {0, 1})
        EXPECT_NEAR(volume.points[i].cube[static_cast<std::size_t>(2 * axis + back)].x,
                    std::max(0.0f, back == 0 ? facing[axis] : -facing[axis]), 1e-5f);
  }
}

/// Two rooms of 3 m behind a wall of 0.1 m, a lamp in the left one.
TestScene twoRooms() {
  TestScene test;
  const int white = test.addMaterial(Vec3(0.7f));
  test.addRoom({0, 0, 0}, {3, 2.5f, 3}, {.material = white, .texels = 16});
  test.addRoom({3.1f, 0, 0}, {6.1f, 2.5f, 3}, {.material = white, .texels = 16});
  Light lamp;
  lamp.type = LightType::Point;
  lamp.color = Vec3(10.0f);
  lamp.position = {1.5f, 2.0f, 1.5f};
  test.scene.lights.push_back(lamp);
  return test;
}

// Nothing of the lit room may be seen in the dark one, however the grid lies: within a cell of the wall, on its surface
// and in the air. The plain lookup is off by the lit room's half.
TEST(LightVolumes, WallsKeepRoomsApart) {
  const Level level(twoRooms());
  double worstMasked = 0.0, worstPlain = 0.0;
  for (const float shift : {0.0f, 0.1f, 0.2f, 0.3f, 0.4f}) {
    const Vec3 least(0.25f + shift, 0.25f, 0.25f);
    const LightVolume volume = level.volume(least, least + Vec3(5.5f - shift, 2.0f, 2.5f), 0.5f);
    const auto at = [&](const Vec3& p, const Vec3& n, VolumeMask mask) {
      return static_cast<double>(lightOn(volume, lookUp(volume, p, n, mask), n, VolumeBasis::Sh1).x);
    };
    const double bright = at({1.5f, 1.25f, 1.5f}, {1, 0, 0}, VolumeMask::Sight);
    EXPECT_GT(bright, 0.1);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const Vec2 u = sobol2D(i, 5);
      const Vec3 p(3.1001f + (i % 2 == 0 ? 0.0f : 0.5f * u.x), 0.3f + 1.9f * u.y, 0.3f + 2.4f * sobol1D(i, 6));
      for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -1)}) {
        worstMasked = std::max(worstMasked, at(p, n, VolumeMask::Sight) / bright);
        worstPlain = std::max(worstPlain, at(p, n, VolumeMask::None) / bright);
      }
    }
  }
  std::printf("of the bright room's light: masked %.4f, plain %.4f\n", worstMasked, worstPlain);
  EXPECT_LE(worstMasked, 0.01);
  EXPECT_GT(worstPlain, 0.1);
}

// Points inside of a block of 1 m: those nearer to its sides than 0.45 of a cell move out, the others are filled from
// points outside, and none is dark.
TEST(LightVolumes, PointsInsideOfThings) {
  TestScene test;
  test.scene.environment.color = Vec3(1.0f);
  const int black = test.addMaterial(Vec3(0.0f));
  const auto side = [&](const Vec3& corner, const Vec3& right, const Vec3& up) {
    test.addRectangle(corner, right, up, {.material = black});
  };
  side({0, 0, 1}, {1, 0, 0}, {0, 1, 0});
  side({1, 0, 0}, {-1, 0, 0}, {0, 1, 0});
  side({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  side({1, 0, 1}, {0, 0, -1}, {0, 1, 0});
  side({0, 1, 1}, {1, 0, 0}, {0, 0, -1});
  side({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  const LightVolume volume = Level(test).volume(Vec3(-0.7f), Vec3(1.7f), 0.4f);
  int moved = 0, filled = 0;
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const VolumePoint& point = volume.points[i];
    const Vec3 at = volume.gridPoint(i), from = at + point.offset;
    const auto isInside = [](const Vec3& p) {
      return std::min({p.x, p.y, p.z}) > 0.0f && std::max({p.x, p.y, p.z}) < 1.0f;
    };
    EXPECT_EQ(point.isValid, !isInside(from));
    moved += isInside(at) && point.isValid ? 1 : 0;
    filled += point.isValid ? 0 : 1;
    EXPECT_LE(std::max({std::abs(point.offset.x), std::abs(point.offset.y), std::abs(point.offset.z)}), 0.45f * 0.4f);
    EXPECT_GT(point.harmonics[0].x, 0.5f);  // half of the sky at least, times sqrt(4 pi)
  }
  EXPECT_GT(moved, 0);
  EXPECT_GT(filled, 0);
}

TEST(LightVolumes, TheSameForAnyNumberOfThreads) {
  const Level level(twoRooms());
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return level.volume(Vec3(0.2f), Vec3(2.8f, 2.2f, 2.8f), 0.3f);
  };
  const LightVolume one = with(1), three = with(3);
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    EXPECT_EQ(one.points[i].harmonics, three.points[i].harmonics);
    EXPECT_EQ(one.points[i].cube, three.points[i].cube);
    EXPECT_EQ(one.points[i].nearness, three.points[i].nearness);
  }
}

}  // namespace
}  // namespace lumel
