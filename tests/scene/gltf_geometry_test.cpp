#include <gtest/gtest.h>

#include "tests/scene/gltf_builder.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

Vec3 faceNormal(const Primitive& p, std::size_t t) {
  const Vec3 a = p.positions[p.indices[3 * t]], b = p.positions[p.indices[3 * t + 1]],
             c = p.positions[p.indices[3 * t + 2]];
  return glm::normalize(glm::cross(b - a, c - a));
}

/// The corner positions of all triangles in order.
std::vector<Vec3> corners(const Primitive& p) {
  std::vector<Vec3> out;
  for (auto i : p.indices) out.push_back(p.positions[i]);
  return out;
}

TEST(GltfGeometry, SquareHasFlatNormalsUvsAndADefaultMaterial) {
  GltfBuilder g;
  g.square();
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].name, "Node");
  ASSERT_EQ(scene.materials.size(), 1u);
  const Primitive& p = scene.primitive(0, 0);
  EXPECT_EQ(p.triangleCount(), 2u);
  EXPECT_EQ(p.positions.size(), 4u);  // coplanar triangles share their flat normal
  for (const Vec3& n : p.normals) EXPECT_EQ(n, Vec3(0, 0, 1));
  ASSERT_EQ(p.uvSets.size(), 1u);
  EXPECT_EQ(p.uvSets[0][0], Vec2(0, 1));
  EXPECT_TRUE(p.tangents.empty());
}

TEST(GltfGeometry, MissingNormalsSplitVerticesWhereTrianglesMeetAtAnAngle) {
  GltfBuilder g;
  // Two triangles about the edge (0,0,0)-(0,0,1), at a right angle.
  const int p = g.accessor<float>("VEC3", {0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0});
  const int i = g.accessor<std::uint8_t>("SCALAR", {0, 1, 2, 1, 0, 3});
  g.mesh({{"attributes", {{"POSITION", p}, {"TANGENT", g.accessor<float>("VEC4", std::vector<float>(16, 1))}}},
          {"indices", i}});
  LOAD_OR_FAIL(scene, g.load());
  const Primitive& q = scene.primitive(0, 0);
  EXPECT_EQ(q.positions.size(), 6u);
  EXPECT_TRUE(q.tangents.empty());  // without normals, tangents are ignored
  for (std::size_t t = 0; t < 2; ++t)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(q.normals[q.indices[3 * t + k]], faceNormal(q, t));
}

TEST(GltfGeometry, StripsAndFansKeepTheWinding) {
  for (const int mode : {5, 6}) {
    GltfBuilder g;
    // A square as a strip (0 1 2 3 zigzag) or a fan about its first corner, seen from +z.
    const std::vector<float> strip = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    const std::vector<float> fan = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    g.mesh({{"attributes", {{"POSITION", g.accessor<float>("VEC3", mode == 5 ? strip : fan)}}}, {"mode", mode}});
    LOAD_OR_FAIL(scene, g.load());
    const Primitive& p = scene.primitive(0, 0);
    ASSERT_EQ(p.triangleCount(), 2u);
    EXPECT_EQ(faceNormal(p, 0), Vec3(0, 0, 1));
    EXPECT_EQ(faceNormal(p, 1), Vec3(0, 0, 1));
  }
}

TEST(GltfGeometry, PointsAndLinesAreSkippedAndCounted) {
  GltfBuilder g;
  g.square();
  for (const int mode : {0, 1, 2, 3}) {
    Json line = g.json["meshes"][0]["primitives"][0];
    line["mode"] = mode;
    g.json["meshes"][0]["primitives"].push_back(line);
  }
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.meshes[0].primitives.size(), 1u);
  EXPECT_EQ(scene.report.skippedPrimitives, 4u);
}

TEST(GltfGeometry, DegenerateTrianglesGoWhateverTheScaleAndTinyOnesStay) {
  for (const float scale : {1e-12f, 1.0f, 1e12f}) {
    GltfBuilder g;
    std::vector<float> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0};
    for (float& x : points) x *= scale;
    // good, repeated index, three in a row, repeated position
    const int i = g.accessor<std::uint32_t>("SCALAR", {0, 1, 2, 0, 1, 1, 0, 1, 3, 0, 4, 1});
    g.mesh({{"attributes", {{"POSITION", g.accessor<float>("VEC3", points)}}}, {"indices", i}});
    LOAD_OR_FAIL(scene, g.load());
    EXPECT_EQ(scene.report.degenerateTriangles, 3u) << scale;
    EXPECT_EQ(scene.primitive(0, 0).triangleCount(), 1u);
    EXPECT_EQ(scene.primitive(0, 0).positions.size(), 3u);  // unused vertices go
  }
}

TEST(GltfGeometry, AMeshOfDegenerateTrianglesLeavesNoInstance) {
  GltfBuilder g;
  g.mesh({{"attributes", {{"POSITION", g.accessor<float>("VEC3", {1, 1, 1, 1, 1, 1, 1, 1, 1})}}}});
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_TRUE(scene.meshes.empty());
  EXPECT_TRUE(scene.instances.empty());
  EXPECT_EQ(scene.report.degenerateTriangles, 1u);
}

template <class T>
void expectNormalizedUvs(float whole) {
  GltfBuilder g;
  auto& primitive = g.square();
  const T max = std::numeric_limits<T>::max();
  primitive["attributes"]["TEXCOORD_0"] =
      g.accessor<T>("VEC2", {0, max, max, max, max, 0, std::numeric_limits<T>::min(), 0}, true);
  LOAD_OR_FAIL(scene, g.load());
  const auto& uvs = scene.primitive(0, 0).uvSets[0];
  EXPECT_EQ(uvs[0], Vec2(0, 1));
  EXPECT_EQ(uvs[2], Vec2(1, 0));
  EXPECT_EQ(uvs[3], Vec2(whole, 0));  // the least integer clamps to -1
}

TEST(GltfGeometry, NormalizedIntegersOfEveryType) {
  expectNormalizedUvs<std::int8_t>(-1);
  expectNormalizedUvs<std::uint8_t>(0);
  expectNormalizedUvs<std::int16_t>(-1);
  expectNormalizedUvs<std::uint16_t>(0);
}

TEST(GltfGeometry, QuantizedPositionsAreReadAsTheyAre) {
  GltfBuilder g;
  g.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  std::vector<std::int16_t> points = {0, 0, 0, -300, 0, 0, 0, 300, 0};
  const int p = g.accessor<std::int16_t>("VEC3", points);
  g.mesh({{"attributes",
           {{"POSITION", p}, {"NORMAL", g.accessor<std::int8_t>("VEC3", {0, 0, 127, 0, 0, 127, 0, 0, 127}, true)}}}});
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.primitive(0, 0).positions[1], Vec3(-300, 0, 0));
  EXPECT_EQ(scene.primitive(0, 0).normals[1], Vec3(0, 0, 1));
}

TEST(GltfGeometry, InterleavedAndOffsetAccessors) {
  GltfBuilder g;
  std::vector<float> rows;
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const Vec3& p : points) rows.insert(rows.end(), {p.x, p.y, p.z, 0, 0, 1, p.x, 1 - p.y});
  const int view = g.view(rows.data(), rows.size() * 4, 32);
  Json attributes;
  const char* names[] = {"POSITION", "NORMAL", "TEXCOORD_0"};
  for (int k = 0; k < 3; ++k)
    attributes[names[k]] = g.add("accessors", {{"bufferView", view},
                                               {"byteOffset", 12 * k},
                                               {"componentType", 5126},
                                               {"count", 3},
                                               {"type", k == 2 ? "VEC2" : "VEC3"}});
  g.mesh({{"attributes", attributes}});
  LOAD_OR_FAIL(scene, g.load());
  const Primitive& p = scene.primitive(0, 0);
  EXPECT_EQ(corners(p), points);
  EXPECT_EQ(p.uvSets[0][2], Vec2(0, 0));
}

TEST(GltfGeometry, SparseAccessorsOverlayBaseOrZeros) {
  for (const bool withBase : {true, false}) {
    GltfBuilder g;
    const int p = g.accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    const std::uint8_t indices[] = {1, 2};
    const float values[] = {5, 0, 0, 0, 7, 0};
    auto& accessor = g.json["accessors"][static_cast<std::size_t>(p)];
    const int indexView = g.view(indices, 2), valueView = g.view(values, sizeof values);
    accessor["sparse"] = {{"count", 2},
                          {"indices", {{"bufferView", indexView}, {"componentType", 5121}}},
                          {"values", {{"bufferView", valueView}}}};
    if (!withBase) accessor.erase("bufferView");
    g.mesh({{"attributes", {{"POSITION", p}}}});
    LOAD_OR_FAIL(scene, g.load());
    EXPECT_EQ(corners(scene.primitive(0, 0)), (std::vector<Vec3>{{0, 0, 0}, {5, 0, 0}, {0, 7, 0}}));
  }
}

TEST(GltfGeometry, ColorsUvSetsAndSeveralPrimitives) {
  GltfBuilder g;
  auto& primitive = g.square();
  primitive["attributes"]["COLOR_0"] =
      g.accessor<std::uint8_t>("VEC3", std::vector<std::uint8_t>{255, 0, 0, 255, 0, 0, 255, 0, 0, 0, 255, 0}, true);
  primitive["attributes"]["TEXCOORD_1"] = g.accessor<float>("VEC2", {0, 0, 0.5f, 0, 0.5f, 0.5f, 0, 0.5f});
  Json second = primitive;
  second["attributes"].erase("COLOR_0");
  g.json["meshes"][0]["primitives"].push_back(second);
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.meshes[0].primitives.size(), 2u);
  const Primitive& p = scene.primitive(0, 0);
  EXPECT_EQ(p.colors[3], Vec4(0, 1, 0, 1));
  ASSERT_EQ(p.uvSets.size(), 2u);
  EXPECT_EQ(p.uvSets[1][2], Vec2(0.5f, 0.5f));
  EXPECT_TRUE(scene.primitive(0, 1).colors.empty());
  EXPECT_EQ(p.name, "mesh 'Mesh' primitive 0");
}

TEST(GltfGeometry, BadNormalsTangentsAndUvsAreRepairedWithAWarning) {
  GltfBuilder g;
  auto& primitive = g.square();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  primitive["attributes"]["NORMAL"] = g.accessor<float>("VEC3", {0, 0, 2, 0, 0, 0, nan, 0, 0, 0, 0, 1});
  primitive["attributes"]["TANGENT"] = g.accessor<float>("VEC4", {2, 0, 0, 1, 0, 0, 0, -1, nan, 0, 0, 1, 1, 0, 0, -1});
  primitive["attributes"]["TEXCOORD_0"] = g.accessor<float>("VEC2", {nan, 1, 1, 1, 1, 0, 0, 0});
  LOAD_OR_FAIL(scene, g.load());
  const Primitive& p = scene.primitive(0, 0);
  for (const Vec3& n : p.normals) EXPECT_EQ(n, Vec3(0, 0, 1));
  for (const Vec4& t : p.tangents) {
    EXPECT_NEAR(glm::length(Vec3(t)), 1, 1e-6);
    EXPECT_NEAR(t.z, 0, 1e-6);
  }
  EXPECT_EQ(p.tangents[3].w, -1);
  EXPECT_EQ(p.uvSets[0][0], Vec2(0, 0));
  EXPECT_EQ(scene.report.warnings.size(), 3u);
}

TEST(GltfGeometry, MorphWeightsOfMeshAndNode) {
  GltfBuilder g;
  auto& primitive = g.square();
  const std::vector<float> up = {0, 0, 4, 0, 0, 4, 0, 0, 4, 0, 0, 4};
  primitive["targets"] = {{{"POSITION", g.accessor<float>("VEC3", up)}}};
  g.json["meshes"][0]["weights"] = {0.5};
  g.add("nodes", {{"mesh", 0}, {"weights", {0.25}}});
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.primitive(scene.instances[0].mesh, 0).positions[0].z, 2);
  EXPECT_EQ(scene.primitive(scene.instances[1].mesh, 0).positions[0].z, 1);
}

TEST(GltfGeometry, AFileWithoutMeshesIsAnEmptyScene) {
  GltfBuilder g;
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_TRUE(scene.instances.empty());
  EXPECT_EQ(scene.materials.size(), 1u);
}

}  // namespace
}  // namespace lumel
