#include "baker/bake/lit_sides.h"

#include <gtest/gtest.h>

#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using testing_scene::TestScene;

/// Adds the six sides of [-1, 1]^3 as one primitive, facing out; side 0 is the top. Those of `wrong` face in.
void addCube(TestScene& test, std::initializer_list<int> wrong, float half = 1.0f) {
  Primitive cube;
  cube.name = "cube";
  cube.material = 0;
  const std::array<std::array<Vec3, 2>, 6> axes = {{{{{0, 0, 1}, {1, 0, 0}}},
                                                    {{{1, 0, 0}, {0, 0, 1}}},
                                                    {{{0, 1, 0}, {0, 0, 1}}},
                                                    {{{0, 0, 1}, {0, 1, 0}}},
                                                    {{{1, 0, 0}, {0, 1, 0}}},
                                                    {{{0, 1, 0}, {1, 0, 0}}}}};
  for (int side = 0; side < 6; ++side) {
    auto [right, up] = axes[static_cast<std::size_t>(side)];
    const Vec3 out = glm::cross(right, up);
    const auto first = static_cast<std::uint32_t>(cube.positions.size());
    for (const Vec2& at : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)})
      cube.positions.push_back(half * (out + at.x * right + at.y * up));
    const bool in = std::find(wrong.begin(), wrong.end(), side) != wrong.end();
    cube.normals.insert(cube.normals.end(), 4, in ? -out : out);
    cube.tangents.insert(cube.tangents.end(), 4, Vec4(right, in ? -1.0f : 1.0f));
    for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) cube.indices.push_back(first + corner);
    if (in) {
      std::swap(cube.indices[cube.indices.size() - 5], cube.indices[cube.indices.size() - 4]);
      std::swap(cube.indices[cube.indices.size() - 2], cube.indices[cube.indices.size() - 1]);
    }
  }
  test.scene.meshes.push_back({cube.name, {cube}});
  Instance instance;
  instance.name = cube.name;
  instance.mesh = static_cast<int>(test.scene.meshes.size()) - 1;
  test.scene.instances.push_back(instance);
}

TestScene doubleSided() {
  TestScene test;
  test.scene.materials[0].doubleSided = true;
  return test;
}

std::size_t turned(Scene& scene) {
  const auto count = turnToLight(scene, Progress());
  EXPECT_TRUE(count) << count.error().message;
  return count ? *count : 0;
}

/// Expects that triangles and normals of the first mesh face out, or in.
void expectFacing(const Scene& scene, float sign) {
  const Primitive& cube = scene.primitive(0, 0);
  for (std::size_t t = 0; t < cube.triangleCount(); ++t) {
    const std::uint32_t* corner = cube.indices.data() + 3 * t;
    const Vec3 a = cube.positions[corner[0]], b = cube.positions[corner[1]], c = cube.positions[corner[2]];
    EXPECT_GT(sign * glm::dot(glm::cross(b - a, c - a), a + b + c), 0.0f) << "triangle " << t;
    for (int k = 0; k < 3; ++k) EXPECT_GT(sign * glm::dot(cube.normals[corner[k]], a + b + c), 0.0f);
  }
}

TEST(LitSides, AFaceWoundIntoASolidIsTurnedWithItsFrame) {
  TestScene test = doubleSided();
  addCube(test, {0});
  test.scene.environment.color = Vec3(1.0f);
  const Vec4 before = test.scene.primitive(0, 0).tangents[0];
  EXPECT_EQ(turned(test.scene), 2u);
  expectFacing(test.scene, 1.0f);
  const Primitive& cube = test.scene.primitive(0, 0);
  EXPECT_EQ(cube.positions.size(), 24u);
  // The specification reverses the normal that a normal map gave: tangent, bitangent w * cross(n, t) and normal.
  std::size_t reversed = 0;
  for (const Vec4& tangent : cube.tangents) reversed += tangent == -before ? 1 : 0;
  EXPECT_EQ(reversed, 4u);
}

TEST(LitSides, WhatIsLitStaysAsItIsWound) {
  TestScene outside = doubleSided();
  addCube(outside, {});
  outside.scene.environment.color = Vec3(1.0f);
  EXPECT_EQ(turned(outside.scene), 0u);

  // A room lit ten thousand times less than the meadow outside: its walls agree about where they face.
  TestScene room = doubleSided();
  addCube(room, {0, 1, 2, 3, 4, 5});
  room.scene.environment.color = Vec3(1.0f);
  Light lamp;
  lamp.intensity = 1e-4f;
  room.scene.lights.push_back(lamp);
  room.addRectangle({-20, -2, 20}, {40, 0, 0}, {0, 0, -40});  // the meadow
  EXPECT_EQ(turned(room.scene), 0u);
}

TEST(LitSides, AClosedRoomWoundOutwardsIsTurnedToItsLamp) {
  TestScene test = doubleSided();
  addCube(test, {});
  test.scene.lights.emplace_back();
  EXPECT_EQ(turned(test.scene), 12u);
  expectFacing(test.scene, -1.0f);
}

TEST(LitSides, ALeakySolidIsTurnedWhereItIsWoundAgainstItsOtherFaces) {
  // Without its bottom the cube stands a little above the ground, and light comes in.
  TestScene test = doubleSided();
  addCube(test, {0});
  Primitive& cube = test.scene.meshes[0].primitives[0];
  cube.indices.erase(cube.indices.begin() + 6, cube.indices.begin() + 12);
  test.addRectangle({-20, -1.1f, 20}, {40, 0, 0}, {0, 0, -40}, {.material = test.addMaterial(Vec3(0.5f))});
  test.scene.environment.color = Vec3(1.0f);
  EXPECT_EQ(turned(test.scene), 2u);
  expectFacing(test.scene, 1.0f);
}

// A sign just off a wall, wound towards it: some light finds its way between, but people see the other side.
TEST(LitSides, ASignWoundTowardsItsWallIsTurnedToThoseWhoSeeIt) {
  for (const bool towardsTheWall : {true, false}) {
    TestScene test = doubleSided();
    const int plain = test.addMaterial(Vec3(0.7f));
    if (towardsTheWall)
      test.addRectangle({0.5f, 1, 0.2f}, {-1, 0, 0}, {0, 1, 0}, {.material = 0});
    else
      test.addRectangle({-0.5f, 1, 0.2f}, {1, 0, 0}, {0, 1, 0}, {.material = 0});
    test.addRectangle({-3, 0, 0}, {6, 0, 0}, {0, 3, 0}, {.material = plain});
    test.scene.environment.color = Vec3(1.0f);
    EXPECT_EQ(turned(test.scene), towardsTheWall ? 2u : 0u);
  }
}

TEST(LitSides, SingleSidedSurfacesAreLeftAlone) {
  TestScene test;
  addCube(test, {0, 3});
  test.scene.environment.color = Vec3(1.0f);
  EXPECT_EQ(turned(test.scene), 0u);
}

TEST(LitSides, MirroredPlacesCountAsTheyLie) {
  TestScene test = doubleSided();
  addCube(test, {2});
  test.scene.environment.color = Vec3(1.0f);
  test.scene.instances[0].worldFromObject = glm::scale(Mat4(1.0f), Vec3(-1.0f, 1.0f, 1.0f));
  EXPECT_EQ(turned(test.scene), 2u);
  expectFacing(test.scene, 1.0f);
}

TEST(LitSides, AnInterruptionIsObeyed) {
  struct Stopped : Progress {
    bool cancelled() const override { return true; }
  };
  TestScene test = doubleSided();
  addCube(test, {0});
  test.scene.environment.color = Vec3(1.0f);
  const auto count = turnToLight(test.scene, Stopped());
  ASSERT_FALSE(count);
  EXPECT_EQ(count.error().kind, ErrorKind::Interrupted);
}

}  // namespace
}  // namespace lumel
