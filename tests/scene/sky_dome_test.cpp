#include "scene/triangles/sky_dome.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumel {
namespace {

/// A floor of 10 x 10 m and one more mesh.
struct Level {
  Scene scene;

  Level() {
    scene.materials.emplace_back();
    add("floor", {{-5, 0, -5}, {5, 0, -5}, {5, 0, 5}, {-5, 0, 5}});
  }
  Instance& add(const std::string& name, const std::vector<Vec3>& positions) {
    Primitive primitive;
    primitive.positions = positions;
    scene.meshes.push_back({name, {primitive}});
    Instance instance;
    instance.name = name;
    instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
    scene.instances.push_back(instance);
    return scene.instances.back();
  }
  std::vector<Vec3> sphere(float radius, float lowest) const {
    std::vector<Vec3> points;
    for (int i = 0; i <= 8; ++i)
      for (int k = 0; k < 16; ++k) {
        const float polar = kPi * static_cast<float>(i) / 8, turn = 2 * kPi * static_cast<float>(k) / 16;
        const Vec3 p =
            radius * Vec3(std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn));
        if (p.y >= lowest) points.push_back(p);
      }
    return points;
  }
  std::vector<Vec3> box(float size) const {
    std::vector<Vec3> points;
    for (int i = 0; i < 8; ++i) points.push_back(size * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    return points;
  }
};

TEST(SkyDome, SpheresAndHalfSpheresAroundALevel) {
  for (const float lowest : {-1000.0f, -1.0f}) {
    Level level;
    level.add("backdrop", level.sphere(1000.0f, lowest));
    EXPECT_EQ(findSkyDomes(level.scene), std::vector<int>{1});
  }
}

TEST(SkyDome, BoxesByTheirMaterialOrName) {
  Level level;
  level.add("room", level.box(20.0f));
  EXPECT_TRUE(findSkyDomes(level.scene).empty());
  level.scene.instances[1].name = "SkyBox";
  EXPECT_EQ(findSkyDomes(level.scene), std::vector<int>{1});
  level.scene.instances[1].name = "room";
  level.scene.materials.emplace_back();
  level.scene.materials[1].unlit = true;
  level.scene.meshes[1].primitives[0].material = 1;
  EXPECT_EQ(findSkyDomes(level.scene), std::vector<int>{1});
  level.scene.instances[1].settings.casts = false;
  EXPECT_TRUE(findSkyDomes(level.scene).empty());
}

TEST(SkyDome, WhatShinesOrHoldsPartOfTheLevelIsNone) {
  Level level;
  level.add("ball", level.sphere(2.0f, -2.0f));
  EXPECT_TRUE(findSkyDomes(level.scene).empty());
  level.scene.materials.emplace_back();
  level.scene.materials[1].emission = Vec3(1.0f);
  level.add("glowing sky", level.sphere(1000.0f, -1000.0f));
  level.scene.meshes[2].primitives[0].material = 1;
  EXPECT_TRUE(findSkyDomes(level.scene).empty());
}

TEST(SkyDome, NothingElse) {
  Scene scene;
  EXPECT_TRUE(findSkyDomes(scene).empty());
}

}  // namespace
}  // namespace lumel
