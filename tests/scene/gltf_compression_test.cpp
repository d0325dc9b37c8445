#include <gtest/gtest.h>

#include "tests/mentions.h"
#include "tests/scene/gltf_samples.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

TEST(GltfMeshopt, AttributesTrianglesAndOctahedralNormals) {
  for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    LOAD_OR_FAIL(scene, meshoptSquare(kTriangles, "TRIANGLES", extension).load());
    const Primitive& p = scene.primitive(0, 0);
    EXPECT_EQ(p.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(p.triangleCount(), 2u);
    // 8-bit octahedral codes are good to about a degree.
    for (const Vec3& n : p.normals) EXPECT_GT(glm::dot(n, Vec3(0, 0.6f, 0.8f)), std::cos(0.02f));
  }
}

TEST(GltfMeshopt, IndexSequences) {
  LOAD_OR_FAIL(scene, meshoptSquare(kIndexSequence, "INDICES").load());
  EXPECT_EQ(scene.primitive(0, 0).indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
}

TEST(GltfMeshopt, ExponentialPositionsAndQuaternionRotations) {
  auto g = meshoptSquare(kTriangles, "TRIANGLES");
  const int p = compressedView(g, kPositionsTimes3Exponential, 4, 12, "ATTRIBUTES", "EXPONENTIAL");
  const int q = compressedView(g, kRotationsQuaternion, 2, 8, "ATTRIBUTES", "QUATERNION");
  g.json["accessors"][0]["bufferView"] = p;
  const int rotations = g.add(
      "accessors", {{"bufferView", q}, {"componentType", 5122}, {"normalized", true}, {"count", 2}, {"type", "VEC4"}});
  g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["ROTATION"] = rotations;
  g.json["buffers"][0]["byteLength"] = g.bin.size();
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.primitive(0, 0).positions[2], Vec3(3, 3, 0));
  ASSERT_EQ(scene.instances.size(), 2u);
  const Vec3 turned(scene.instances[1].worldFromObject * Vec4(1, 0, 0, 0));
  EXPECT_NEAR(turned.y, 1, 1e-3);  // a quarter turn about z; 16-bit quaternions
}

TEST(GltfMeshopt, DamageIsAnErrorThatNamesTheView) {
  const auto message = [](const std::function<void(Json&)>& change) {
    auto g = meshoptSquare(kTriangles, "TRIANGLES");
    change(g.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]);
    auto result = g.load();
    return result ? std::string("(it loads)") : result.error().message;
  };
  EXPECT_TRUE(
      mentions(message([](Json& e) { e["byteLength"] = 40; }),
               "test.glb: bufferViews/0/extensions/EXT_meshopt_compression: its compressed bytes cannot be decoded"));
  EXPECT_TRUE(mentions(message([](Json& e) { e["byteLength"] = 4000; }), "lie outside their buffer"));
  EXPECT_TRUE(
      mentions(message([](Json& e) { e["count"] = 2000000000; }), "a count of 2000000000 cannot come from 67 bytes"));
  EXPECT_TRUE(mentions(message([](Json& e) { e["byteStride"] = 13; }), "byteStride 13 does not fit"));
  EXPECT_TRUE(
      mentions(message([](Json& e) { e["filter"] = "COLOR"; }), "filter 'COLOR' with byteStride 12 is not supported"));
  EXPECT_TRUE(mentions(message([](Json& e) { e["mode"] = "STRIPS"; }), "bufferViews/0"));
}

TEST(GltfDraco, PositionsUvsColoursAndWinding) {
  LOAD_OR_FAIL(scene, dracoSquare().load());
  const Primitive& p = scene.primitive(0, 0);
  EXPECT_EQ(p.triangleCount(), 2u);
  for (std::size_t v = 0; v < p.positions.size(); ++v) {
    EXPECT_EQ(p.normals[v], Vec3(0, 0, 1));
    EXPECT_NEAR(p.uvSets[0][v].x, p.positions[v].x, 1e-6);
    EXPECT_NEAR(p.uvSets[0][v].y, 1 - p.positions[v].y, 1e-6);
    EXPECT_EQ(p.colors[v], Vec4(1, 0.2f, 0, 1));
  }
}

TEST(GltfDraco, DamageAndWrongIdsAreErrors) {
  auto g = dracoSquare();
  g.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 9;
  auto wrongId = g.load();
  ASSERT_FALSE(wrongId);
  EXPECT_TRUE(mentions(
      wrongId.error().message,
      "test.glb: meshes/0/primitives/0/extensions/KHR_draco_mesh_compression: has no Draco attribute 9 for POSITION"));
  g = dracoSquare();
  g.json["bufferViews"][0]["byteLength"] = 60;
  auto cut = g.load();
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().kind, ErrorKind::Input);
  EXPECT_TRUE(mentions(cut.error().message, "Draco data cannot be decoded"));
}

}  // namespace
}  // namespace lumel
