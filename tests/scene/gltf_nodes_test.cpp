#include <gtest/gtest.h>

#include "tests/mentions.h"
#include "tests/scene/gltf_builder.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

Vec3 world(const Instance& i, const Vec3& p) { return Vec3(i.worldFromObject * Vec4(p, 1)); }

void expectNear(const Vec3& a, const Vec3& b, float tolerance = 1e-5f) {  // float rounding of a few products
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance);
}

TEST(GltfNodes, TransformsMultiplyDownTheTreeAndMeshesAreShared) {
  GltfBuilder g;
  g.square();
  const double h = std::sqrt(0.5);
  g.json["nodes"] = {{{"translation", {10, 0, 0}}, {"rotation", {0, h, 0, h}}, {"children", {1, 2}}},
                     {{"mesh", 0}, {"scale", {2, 1, 1}}, {"name", "A"}},
                     {{"mesh", 0}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1}}, {"name", "B"}}};
  g.json["scenes"] = {{{"nodes", {0}}}};
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.instances[0].name, "A");
  // 90 degrees about y takes x to -z.
  expectNear(world(scene.instances[0], {1, 0, 0}), {10, 0, -2});
  expectNear(world(scene.instances[1], {1, 0, 0}), {10, 5, 1});
  EXPECT_LT(glm::determinant(Mat3(scene.instances[1].worldFromObject)), 0);  // mirrored
}

TEST(GltfNodes, DefaultSceneElseSceneZeroElseAllRoots) {
  GltfBuilder g;
  g.square();
  g.json["nodes"] = {{{"mesh", 0}, {"name", "A"}}, {{"mesh", 0}, {"name", "B"}}};
  const auto names = [&] {
    std::string all;
    auto scene = g.load();
    if (!scene) return scene.error().message;
    for (const auto& i : scene->instances) all += i.name;
    return all;
  };
  EXPECT_EQ(names(), "AB");
  g.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  EXPECT_EQ(names(), "A");
  g.json["scene"] = 1;
  EXPECT_EQ(names(), "B");
  g.json["scenes"][1]["nodes"] = {1, 1};  // listed twice: placed once
  EXPECT_EQ(names(), "B");
}

TEST(GltfNodes, AFlatteningScaleIsBakedIntoTheMesh) {
  GltfBuilder g;
  // A quarter-turned square flattened to y = 0 stays a triangle pair; the normal must be the sheet's.
  const int p = g.accessor<float>("VEC3", {0, 0, 0, 0, 1, 1, 1, 0, 0});
  g.mesh({{"attributes", {{"POSITION", p}, {"NORMAL", g.accessor<float>("VEC3", {0, 1, -1, 0, 1, -1, 0, 1, -1})}}}});
  g.json["nodes"][0]["scale"] = {2, 0, 1};
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].worldFromObject, Mat4(1.0f));
  const Primitive& q = scene.primitive(0, 0);
  EXPECT_EQ(q.positions[2], Vec3(2, 0, 0));
  expectNear(q.normals[0], {0, 1, 0});
  g.json["nodes"][0]["scale"] = {0, 0, 1};  // a line: nothing is left
  LOAD_OR_FAIL(line, g.load());
  EXPECT_TRUE(line.instances.empty());
  EXPECT_EQ(line.report.degenerateTriangles, 1u);
}

TEST(GltfNodes, LightsStandWhereTheirNodesDo) {
  GltfBuilder g;
  const double h = std::sqrt(0.5);
  g.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", 30}, {"color", {1, 0.5, 0.25}}, {"range", 8}, {"name", "Lamp"}},
      {{"type", "directional"}},
      {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.3}, {"outerConeAngle", 0.2}}}}};
  for (int i = 0; i < 3; ++i)
    g.add("nodes", {{"translation", {1, 2, 3}},
                    {"rotation", {-h, 0, 0, h}},  // -z turns to -y
                    {"scale", {3, 3, 3}},
                    {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0].name, "Lamp");
  EXPECT_EQ(scene.lights[0].intensity, 30);
  EXPECT_EQ(scene.lights[0].color, Vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(scene.lights[0].range, 8);
  EXPECT_EQ(scene.lights[0].position, Vec3(1, 2, 3));
  EXPECT_EQ(scene.lights[1].type, LightType::Directional);
  expectNear(scene.lights[1].direction, {0, -1, 0});
  EXPECT_EQ(scene.lights[2].type, LightType::Spot);
  EXPECT_LE(scene.lights[2].innerConeAngle, scene.lights[2].outerConeAngle);
}

TEST(GltfNodes, CamerasIgnoreTheirNodesScale) {
  GltfBuilder g;
  g.json["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}, {"aspectRatio", 1.5}}}},
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 4}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}}};
  g.json["nodes"] = {{{"camera", 0}, {"translation", {1, 2, 3}}, {"scale", {5, 5, 5}}}, {{"camera", 1}}};
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.cameras.size(), 2u);
  EXPECT_FLOAT_EQ(scene.cameras[0].yFov, 0.7f);
  EXPECT_FLOAT_EQ(scene.cameras[0].aspect, 1.5f);
  expectNear(Vec3(scene.cameras[0].worldFromCamera[2]), {0, 0, 1});
  expectNear(Vec3(scene.cameras[0].worldFromCamera[3]), {1, 2, 3});
  EXPECT_TRUE(scene.cameras[1].orthographic);
  EXPECT_EQ(scene.cameras[1].yExtent, 2);
  EXPECT_EQ(scene.cameras[1].aspect, 2);
}

TEST(GltfNodes, GpuInstancing) {
  GltfBuilder g;
  g.square();
  const int t = g.accessor<float>("VEC3", {0, 0, 0, 7, 0, 0});
  const int r = g.accessor<std::int16_t>("VEC4", {0, 0, 0, 32767, 0, 0, 32767, 0}, true);  // half a turn about z
  const int s = g.accessor<float>("VEC3", {1, 1, 1, 2, 2, 2});
  g.json["nodes"][0]["translation"] = {0, 1, 0};
  g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", t}, {"ROTATION", r}, {"SCALE", s}, {"_ID", s}};
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.instances[1].name, "Node[1]");
  expectNear(world(scene.instances[0], {1, 0, 0}), {1, 1, 0});
  expectNear(world(scene.instances[1], {1, 0, 0}), {5, 1, 0});
  g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
      g.accessor<float>("VEC3", {1, 1, 1});
  auto bad = g.load();
  ASSERT_FALSE(bad);
  EXPECT_TRUE(mentions(bad.error().message, "nodes/0/extensions/EXT_mesh_gpu_instancing: its attributes differ"));
}

TEST(GltfNodes, SkinsStandInTheFilesPose) {
  GltfBuilder g;
  auto& primitive = g.square();
  // All vertices follow joint 1, but the first is shared half and half with joint 0.
  primitive["attributes"]["JOINTS_0"] =
      g.accessor<std::uint8_t>("VEC4", {0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  primitive["attributes"]["WEIGHTS_0"] =
      g.accessor<float>("VEC4", {0.5f, 0.5f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  std::vector<float> bind = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::vector<float> both = bind;
  both.insert(both.end(), bind.begin(), bind.end());
  both[16 + 12] = 1;  // joint 1 shifts by +1 in x from bind pose
  g.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}},  // does not count
                     {{"translation", {0, 0, 2}}},
                     {{"translation", {0, 0, 4}}}};
  g.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", g.accessor<float>("MAT4", both)}}};
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].worldFromObject, Mat4(1.0f));
  const Primitive& p = scene.primitive(0, 0);
  expectNear(p.positions[0], {0.5f, 0, 3});
  expectNear(p.positions[1], {2, 0, 4});
}

TEST(GltfNodes, ObjectSettingsFromMeshAndNodeExtras) {
  GltfBuilder g;
  g.square();
  g.json["meshes"][0]["extras"]["lumel"] = {{"scale", 3}, {"casts", false}};
  g.json["nodes"][0]["extras"]["lumel"] = {{"scale", 0.5}, {"receives", false}};
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.instances[0].settings.texelDensityScale, 0.5f);
  EXPECT_FALSE(scene.instances[0].settings.casts);
  EXPECT_FALSE(scene.instances[0].settings.receives);
  const auto message = [&](const Json& lumel) {
    g.json["nodes"][0]["extras"]["lumel"] = lumel;
    auto result = g.load();
    return result ? std::string() : result.error().message;
  };
  EXPECT_EQ(message({{"scale", 0}}), "test.glb: nodes/0/extras/lumel: scale must be a number above 0");
  EXPECT_EQ(message({{"casts", 2}}), "test.glb: nodes/0/extras/lumel: casts must be true or false");
  EXPECT_EQ(message({{"scales", 1}}),
            "test.glb: nodes/0/extras/lumel: 'scales' is not known; use scale, casts, receives, light or volume");
}

TEST(GltfNodes, LightVolumes) {
  GltfBuilder g;
  g.square();
  g.add("nodes", {{"name", "Hall"},
                  {"translation", {1, 2, 3}},
                  {"scale", {2, 1, 1}},
                  {"extras", {{"lumel", {{"volume", {{"size", {4, 3, 2}}, {"cell", 0.25}}}}}}}});
  g.json["scenes"][0]["nodes"].push_back(1);
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.volumes.size(), 1u);
  EXPECT_EQ(scene.volumes[0].name, "Hall");
  expectNear(scene.volumes[0].least, {-3, 0.5f, 2});
  expectNear(scene.volumes[0].most, {5, 3.5f, 4});
  EXPECT_EQ(scene.volumes[0].cell, 0.25f);
  const auto message = [&](const Json& volume) {
    g.json["nodes"][1]["extras"]["lumel"]["volume"] = volume;
    auto result = g.load();
    return result ? std::string() : result.error().message;
  };
  const std::string place = "test.glb: nodes/1/extras/lumel/volume: ";
  EXPECT_EQ(message(5), place + "must be an object such as {\"size\": [4, 3, 4], \"cell\": 0.5}, in metres");
  EXPECT_EQ(message({{"size", {1, 1}}}), place + "size must be three numbers of metres");
  EXPECT_EQ(message({{"size", {1, 1, 1}}, {"cell", 0}}), place + "cell must be a number of metres above 0");
  EXPECT_EQ(message({{"size", {1, 1, 1}}, {"step", 1}}), place + "'step' is not known; use size and cell");
}

TEST(GltfNodes, DeepTreesDoNotOverflowTheStack) {
  GltfBuilder g;
  g.square();
  g.json["nodes"] = Json::array();
  constexpr int kDepth = 50000;
  for (int i = 0; i < kDepth; ++i) g.json["nodes"].push_back({{"children", {i + 1}}, {"translation", {0.5, 0, 0}}});
  g.json["nodes"].push_back({{"mesh", 0}});
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(world(scene.instances[0], {0, 0, 0}), Vec3(kDepth / 2, 0, 0));
}

}  // namespace
}  // namespace lumel
