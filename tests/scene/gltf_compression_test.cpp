// meshopt and Draco: the unit square, encoded once with meshoptimizer 0.18 and Draco 1.5 and kept as literals.
#include <gtest/gtest.h>

#include "scene/file_access.h"
#include "tests/scene/gltf_builder.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

constexpr const char* kPositions =
    "oAAAATMAAAD//wEzAAAAfn0AAAEMAAAA/wEMAAAAfgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==";
constexpr const char* kPositionsTimes3Exponential =
    "oAABMwAAAGBfAAEwAAAABAABDAAAAGAAATAAAAAEAAAAATAAAAAEAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADyAAAA8gAAAPI=";
constexpr const char* kNormalsOctahedral = "oAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADZ/AA==";
constexpr const char* kRotationsQuaternion = "oAEQAAAAATAAAAD+AAAAAAEQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAP9/";
constexpr const char* kTriangles = "4fAAAHaHVmd4qYZliWiYAWkAAA==";
constexpr const char* kIndexSequence = "0QAEBAYIBAAAAAA=";
// Positions (11 bits), UVs (10 bits), colours (255, 51, 0, 255); attribute ids 0, 1, 2.
constexpr const char* kDraco =
    "RFJBQ08CAgEBAAAABAICAgAAAR//ARH/ARH/ARED/wAAAAAAAQAAAQAJAwAAAgEDCQIAAQIBAgIEAAIBAQEBAAMDATABEAMAKIKYAAAAAAD/BwAAAAAAAAAA"
    "AAAAAAAAAACAPwsBAQEAAwMBIAEgAwDwg6YAAAAAAP8DAAAAAAAAAAAAAAAAgD8KAQEBAQFnATQBCP+PAQQEAJk+jQAAAAD/AAAA";

std::vector<std::uint8_t> decoded(const std::string& base64) { return *decodeDataUri("data:;base64," + base64); }

/// Adds a view that is compressed with `extension` and whose plain bytes are in a buffer without any.
int compressedView(GltfBuilder& g, const char* base64, int count, int stride, const char* mode, const char* filter = "NONE",
                   const char* extension = "EXT_meshopt_compression") {
  const auto bytes = decoded(base64);
  const int at = g.view(bytes.data(), bytes.size());
  Json& view = g.json["bufferViews"][static_cast<std::size_t>(at)];
  Json compressed = {{"buffer", 0}, {"byteOffset", view["byteOffset"]}, {"byteLength", view["byteLength"]},
                     {"byteStride", stride}, {"count", count}, {"mode", mode}, {"filter", filter}};
  view = {{"buffer", 1}, {"byteLength", count * stride}, {"extensions", {{extension, compressed}}}};
  return at;
}

GltfBuilder meshoptSquare(const char* indices, const char* mode, const char* extension = "EXT_meshopt_compression") {
  GltfBuilder g;
  g.json["extensionsRequired"] = {extension};
  const int p = g.add("accessors", {{"bufferView", compressedView(g, kPositions, 4, 12, "ATTRIBUTES", "NONE", extension)}, {"componentType", 5126}, {"count", 4}, {"type", "VEC3"}});
  const int n = g.add("accessors", {{"bufferView", compressedView(g, kNormalsOctahedral, 4, 4, "ATTRIBUTES", "OCTAHEDRAL", extension)}, {"componentType", 5120}, {"normalized", true}, {"count", 4}, {"type", "VEC3"}});
  g.json["bufferViews"].back()["byteStride"] = 4;
  const int i = g.add("accessors", {{"bufferView", compressedView(g, indices, 6, 4, mode, "NONE", extension)}, {"componentType", 5125}, {"count", 6}, {"type", "SCALAR"}});
  g.mesh({{"attributes", {{"POSITION", p}, {"NORMAL", n}}}, {"indices", i}});
  g.json["buffers"] = {{{"byteLength", g.bin.size()}}, {{"byteLength", 88}, {"extensions", {{extension, {{"fallback", true}}}}}}};
  return g;
}

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
  const int rotations = g.add("accessors", {{"bufferView", q}, {"componentType", 5122}, {"normalized", true}, {"count", 2}, {"type", "VEC4"}});
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
  EXPECT_NE(message([](Json& e) { e["byteLength"] = 40; }).find("test.glb: bufferViews/0/extensions/EXT_meshopt_compression: its compressed bytes cannot be decoded"), std::string::npos);
  EXPECT_NE(message([](Json& e) { e["byteLength"] = 4000; }).find("lie outside their buffer"), std::string::npos);
  EXPECT_NE(message([](Json& e) { e["count"] = 2000000000; }).find("a count of 2000000000 cannot come from 67 bytes"), std::string::npos);
  EXPECT_NE(message([](Json& e) { e["byteStride"] = 13; }).find("byteStride 13 does not fit"), std::string::npos);
  EXPECT_NE(message([](Json& e) { e["filter"] = "COLOR"; }).find("filter 'COLOR' with byteStride 12 is not supported"), std::string::npos);
  EXPECT_NE(message([](Json& e) { e["mode"] = "STRIPS"; }).find("bufferViews/0"), std::string::npos);
}

GltfBuilder dracoSquare() {
  GltfBuilder g;
  g.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  const auto bytes = decoded(kDraco);
  const int view = g.view(bytes.data(), bytes.size());
  const auto attribute = [&](int type, const char* shape, bool normalized) {
    return g.add("accessors", {{"componentType", type}, {"count", 4}, {"type", shape}, {"normalized", normalized}});
  };
  const int p = attribute(5126, "VEC3", false), uv = attribute(5126, "VEC2", false), color = attribute(5121, "VEC4", true);
  g.mesh({{"attributes", {{"POSITION", p}, {"TEXCOORD_0", uv}, {"COLOR_0", color}}},
          {"indices", g.add("accessors", {{"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}})},
          {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}, {"COLOR_0", 2}}}}}}}});
  return g;
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
  EXPECT_NE(wrongId.error().message.find("test.glb: meshes/0/primitives/0/extensions/KHR_draco_mesh_compression: has no Draco attribute 9 for POSITION"), std::string::npos);
  g = dracoSquare();
  g.json["bufferViews"][0]["byteLength"] = 60;
  auto cut = g.load();
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().kind, ErrorKind::Input);
  EXPECT_NE(cut.error().message.find("Draco data cannot be decoded"), std::string::npos);
}

}  // namespace
}  // namespace lumel
