// Every wrong file gives one line that names file, place, problem and what to do; none crashes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "scene/load/load_scene.h"
#include "tests/mentions.h"
#include "tests/scene/gltf_builder.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

std::string errorOf(const Expected<Scene>& result) {
  if (result) return "(it loads)";
  EXPECT_EQ(result.error().kind, ErrorKind::Input) << result.error().message;
  EXPECT_FALSE(mentions(result.error().message, "\n"));
  return result.error().message;
}

/// What loading the unit square says after `change`.
std::string broken(const std::function<void(GltfBuilder&)>& change) {
  GltfBuilder g;
  g.square();
  change(g);
  return errorOf(g.load());
}

std::string textError(const std::string& text) {
  return errorOf(loadGltf({text.begin(), text.end()}, "test.gltf", "/nonexistent", {}));
}

TEST(GltfErrors, Container) {
  GltfBuilder g;
  g.square();
  auto bytes = g.glb();
  bytes.resize(bytes.size() - 8);
  EXPECT_TRUE(mentions(errorOf(loadGltf(bytes, "cut.glb", "", {})), "cut.glb: GLB container: a file of"));
  bytes.resize(10);
  EXPECT_TRUE(mentions(errorOf(loadGltf(bytes, "cut.glb", "", {})), "the header is cut off at 10 bytes"));
  auto old = g.glb();
  old[4] = 1;
  EXPECT_EQ(errorOf(loadGltf(old, "old.glb", "", {})),
            "old.glb: GLB container: version 1 is not 2; convert the file to glTF 2.0");
  EXPECT_TRUE(mentions(errorOf(loadGltf({}, "empty.gltf", "", {})), "empty.gltf: JSON: "));
}

TEST(GltfErrors, Json) {
  EXPECT_TRUE(
      mentions(textError("{\"asset\": {\"version\": \"2.0\"}, }"), "test.gltf: JSON: parse error at line 1, column 3"));
  EXPECT_TRUE(mentions(textError("[]"), "asset/version: is missing"));
  EXPECT_EQ(textError("{\"asset\": {\"version\": \"1.0\"}}"),
            "test.gltf: asset/version: '1.0' is not 2.x; convert the file to glTF 2.0");
  EXPECT_EQ(textError("{\"asset\": {\"version\": \"2.1\", \"minVersion\": \"2.1\"}}"),
            "test.gltf: asset/minVersion: '2.1' asks for more than glTF 2.0; export as 2.0");
  std::string deep = "{\"asset\": {\"version\": \"2.0\"}, \"extras\": ";
  deep += std::string(100000, '[') + std::string(100000, ']') + "}";
  EXPECT_EQ(textError(deep), "test.gltf: JSON: nested deeper than 128 levels");
}

TEST(GltfErrors, RequiredExtensionsAreNamed) {
  EXPECT_EQ(broken([](auto& g) {
              g.json["extensionsRequired"] = {"KHR_texture_transform", "ACME_teapots"};
              g.json["nodes"][0]["extensions"]["ACME_teapots"] = Json::object();
            }),
            "test.glb: extensionsRequired: 'ACME_teapots' is not supported; export without it");
  EXPECT_EQ(broken([](auto& g) {
              g.json["extensionsUsed"] = {"ACME_teapots", "KHR_materials_variants"};
            }),
            "(it loads)");
}

/// The warnings of a square that was changed, one per line.
template <class Change>
std::string warningsOf(const Change& change) {
  GltfBuilder g;
  g.square();
  change(g);
  const auto scene = g.load();
  if (!scene) return "(it does not load) " + scene.error().message;
  std::string all;
  for (const std::string& warning : scene->report.warnings) all += warning + "\n";
  return all;
}

TEST(GltfErrors, RequiredExtensionsThatNothingUsesAreWarnedOf) {
  EXPECT_EQ(warningsOf([](auto& g) { g.json["extensionsRequired"] = {"ACME_teapots"}; }),
            "test.glb: extensionsRequired: 'ACME_teapots' is not supported; nothing in the file uses it\n");
}

TEST(GltfErrors, WholeNumbersWrittenWithAFractionAreRead) {
  EXPECT_EQ(
      warningsOf([](auto& g) {
        g.json["accessors"][0]["count"] = 4.0;
        g.json["nodes"][0]["mesh"] = 0.0;
      }),
      "test.glb: accessors/0/count: must be a whole number, not negative; numbers written as 1.0 are read as 1\n");
  EXPECT_EQ(broken([](auto& g) { g.json["accessors"][0]["count"] = 4.5; }),
            "test.glb: accessors/0/count: must be a whole number, not negative");
}

TEST(GltfErrors, LightsOutsideOfTheFormatAreWarnedOf) {
  const auto light = [](const Json& json) {
    return warningsOf([&](auto& g) {
      g.json["extensions"]["KHR_lights_punctual"]["lights"] = {json};
      g.json["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    });
  };
  EXPECT_EQ(light({{"type", "point"}, {"name", "L"}, {"intensity", 5}, {"range", 3}}), "");
  EXPECT_TRUE(
      mentions(light({{"type", "point"}, {"name", "L"}, {"intensity", -5}}), "light 'L': its intensity is negative"));
  EXPECT_TRUE(mentions(light({{"type", "point"}, {"color", {-1, 1, 1}}}), "its colour is negative"));
  for (const int range : {0, -3})
    EXPECT_TRUE(
        mentions(light({{"type", "point"}, {"name", "L"}, {"range", range}}), "light 'L': a range must be above 0"));
  const auto spot = [&](double inner, double outer) {
    return light({{"type", "spot"}, {"spot", {{"innerConeAngle", inner}, {"outerConeAngle", outer}}}});
  };
  EXPECT_EQ(spot(0.2, 0.5), "");
  EXPECT_EQ(spot(0.0, 1.5707964), "");  // pi / 2 as a float
  EXPECT_TRUE(mentions(spot(0.8, 0.3), "is outside of the format"));
  EXPECT_TRUE(mentions(spot(0.2, 2.5), "is outside of the format"));
  EXPECT_TRUE(mentions(spot(0.0, 0.0), "is outside of the format"));
}

TEST(GltfErrors, IndicesOutOfRangeInTheJson) {
  const std::pair<const char*, const char*> cases[] = {{"/meshes/0/primitives/0/attributes/POSITION", "accessors"},
                                                       {"/meshes/0/primitives/0/indices", "accessors"},
                                                       {"/meshes/0/primitives/0/material", "materials"},
                                                       {"/accessors/0/bufferView", "bufferViews"},
                                                       {"/bufferViews/0/buffer", "buffers"},
                                                       {"/nodes/0/mesh", "meshes"},
                                                       {"/nodes/0/children/0", "nodes"},
                                                       {"/nodes/0/camera", "cameras"},
                                                       {"/nodes/0/skin", "skins"},
                                                       {"/scene", "scenes"}};
  for (const auto& [pointer, array] : cases)
    for (const Json& value : {Json(99), Json(-1)}) {
      const std::string expected =
          std::string("test.glb: ") + (pointer + 1) + ": is " + value.dump() + ", but there are ";
      EXPECT_EQ(broken([&, p = pointer](auto& g) { g.json[Json::json_pointer(p)] = value; }).substr(0, expected.size()),
                expected)
          << array;
    }
  EXPECT_EQ(broken([](auto& g) { g.json["accessors"][0]["count"] = -4; }),
            "test.glb: accessors/0/count: must be a whole number, not negative");
  EXPECT_EQ(broken([](auto& g) {
              g.json["nodes"][0]["scale"] = {1, 1};
            }),
            "test.glb: nodes/0/scale: must have 3 numbers");
  EXPECT_EQ(broken([](auto& g) { g.json["nodes"][0]["mesh"] = "wall"; }),
            "test.glb: nodes/0/mesh: must be an index into meshes");
}

TEST(GltfErrors, VertexIndexOutOfRange) {
  EXPECT_EQ(broken([](auto& g) {
              g.json["meshes"][0]["primitives"][0]["indices"] =
                  g.template accessor<std::uint16_t>("SCALAR", {0, 1, 2, 0, 2, 9});
            }),
            "test.glb: meshes/0/primitives/0/indices: entry 5 is 9, but there are 4 vertices; export again");
}

TEST(GltfErrors, AccessorsBeyondTheirBytes) {
  EXPECT_TRUE(
      mentions(broken([](auto& g) { g.json["accessors"][0]["count"] = 5; }),
               "test.glb: accessors/0: 5 elements from byte 0 on do not fit bufferViews/0, which has 48 bytes"));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["accessors"][0]["count"] = std::uint64_t{1} << 62; }),
                       "test.glb: accessors/0: "));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["accessors"][0]["byteOffset"] = (std::uint64_t{1} << 63) - 1; }),
                       "test.glb: accessors/0: "));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["bufferViews"][0]["byteLength"] = 100000; }),
                       "test.glb: bufferViews/0: 100000 bytes from 0 on do not fit buffers/0"));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["bufferViews"][0]["byteStride"] = 4; }),
                       "accessors/0: byteStride 4 is less than an element's 12 bytes"));
  EXPECT_TRUE(mentions(broken([](auto& g) {
                         g.json["accessors"][0].erase("bufferView");
                         g.json["accessors"][0]["count"] = std::uint64_t{1} << 40;
                       }),
                       "elements without a bufferView"));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["accessors"][0]["type"] = "VEC2"; }),
                       "accessors/0: has 2 components where 3 are needed"));
  EXPECT_TRUE(mentions(broken([](auto& g) { g.json["accessors"][1]["count"] = 3; }),
                       "meshes/0/primitives/0/attributes/TEXCOORD_0: has 3 elements, but there are 4 vertices"));
}

TEST(GltfErrors, SparseIndexOutOfRange) {
  EXPECT_TRUE(mentions(broken([](auto& g) {
                         const std::uint8_t index[] = {4};
                         const float value[] = {1, 2, 3};
                         const int i = g.view(index, 1), v = g.view(value, 12);
                         g.json["accessors"][0]["sparse"] = {{"count", 1},
                                                             {"indices", {{"bufferView", i}, {"componentType", 5121}}},
                                                             {"values", {{"bufferView", v}}}};
                       }),
                       "accessors/0/sparse/indices: entry 0 is 4, but the accessor has 4 elements"));
}

TEST(GltfErrors, PositionsThatAreNotFinite) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
    EXPECT_EQ(broken([&](auto& g) {
                g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
                    g.template accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 1, bad, 0, 0, 1, 0});
              }),
              "test.glb: meshes/0/primitives/0/attributes/POSITION: vertex 2 is not finite; repair the mesh and export "
              "again");
}

TEST(GltfErrors, NodeCyclesAndSharedChildren) {
  EXPECT_EQ(broken([](auto& g) {
              g.json["nodes"] = {{{"children", {1}}}, {{"children", {0}}, {"mesh", 0}}};
            }),
            "test.glb: nodes/0: is its own ancestor; correct the node tree");
  EXPECT_EQ(broken([](auto& g) {
              g.json["nodes"] = {{{"children", {0}}}};
            }),
            "test.glb: nodes/0: is its own ancestor; correct the node tree");
  EXPECT_EQ(broken([](auto& g) {
              g.json["nodes"] = {{{"children", {2}}}, {{"children", {2}}}, {{"mesh", 0}}};
            }),
            "test.glb: nodes/1/children/0: node 2 is already a child of node 0; a node has one parent");
}

TEST(GltfErrors, TransformsThatOverflow) {
  EXPECT_TRUE(mentions(
      broken([](auto& g) {
        g.json["nodes"] = {{{"scale", {1e15, 1, 1}}, {"children", {1}}}, {{"scale", {1e15, 1, 1}}, {"mesh", 0}}};
      }),
      "test.glb: nodes/1: its transform reaches beyond 1e18 m"));
}

class GltfFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = scratch();
    fs::create_directories(folder_ / "scene");
    builder_.square();
  }
  void write(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
  }
  std::string binText() const { return {builder_.bin.begin(), builder_.bin.end()}; }
  /// Writes scene/level.gltf with this buffer uri and loads it.
  Expected<Scene> loadWith(const std::string& uri, const LoadOptions& options = {}) {
    builder_.json["buffers"] = {{{"uri", uri}, {"byteLength", builder_.bin.size()}}};
    write(folder_ / "scene" / "level.gltf", builder_.json.dump());
    return loadScene(folder_ / "scene" / "level.gltf", options);
  }
  fs::path folder_;
  GltfBuilder builder_;
};

TEST_F(GltfFiles, ExternalBuffersWithEscapedAndUnicodeNames) {
  write(folder_ / "scene" / "my bu\xE2\x9D\xA4.bin", binText());
  EXPECT_EQ(errorOf(loadWith("my%20bu\xE2\x9D\xA4.bin")), "(it loads)");
}

TEST_F(GltfFiles, MissingAndShortBuffers) {
  EXPECT_TRUE(mentions(errorOf(loadWith("gone.bin")), "gone.bin: no such file; put the buffer beside the scene file"));
  write(folder_ / "scene" / "short.bin", binText().substr(0, 40));
  EXPECT_TRUE(mentions(errorOf(loadWith("short.bin")), "buffers/0: has 40 of its "));
  EXPECT_TRUE(mentions(errorOf(loadWith("data:application/octet-stream;base64,!!!")),
                       "buffers/0/uri: is a data URI with a character that is not base64"));
}

TEST_F(GltfFiles, ABufferThatNothingReadsMayBeMissing) {
  builder_.json["accessors"].push_back(
      {{"bufferView", builder_.json["bufferViews"].size()}, {"componentType", 5126}, {"count", 1}, {"type", "SCALAR"}});
  builder_.json["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 4}});
  write(folder_ / "scene" / "here.bin", binText());
  builder_.json["buffers"] = {{{"uri", "here.bin"}, {"byteLength", builder_.bin.size()}},
                              {{"uri", "gone.bin"}, {"byteLength", 4}}};
  write(folder_ / "scene" / "level.gltf", builder_.json.dump());
  LOAD_OR_FAIL(scene, loadScene(folder_ / "scene" / "level.gltf", {}));
  ASSERT_EQ(scene.report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene.report.warnings[0], "buffers/1: "));
  EXPECT_TRUE(mentions(scene.report.warnings[0], "gone.bin: no such file"));
}

TEST_F(GltfFiles, MissingTexturesAreGreyAndDark) {
  write(folder_ / "scene" / "here.bin", binText());
  builder_.json["buffers"] = {{{"uri", "here.bin"}, {"byteLength", builder_.bin.size()}}};
  builder_.json["images"] = {{{"uri", "gone.png"}}};
  // The second texture has an image that only KHR_texture_basisu names.
  builder_.json["textures"] = {{{"source", 0}}, {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}};
  builder_.json["extensionsRequired"] = {"KHR_texture_basisu"};
  for (const int texture : {0, 1}) {
    builder_.json["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 1, 0.25}}, {"baseColorTexture", {{"index", texture}}}}},
         {"emissiveFactor", {1, 1, 1}},
         {"emissiveTexture", {{"index", texture}}}}};
    builder_.json["meshes"][0]["primitives"][0]["material"] = 0;
    write(folder_ / "scene" / "level.gltf", builder_.json.dump());
    LOAD_OR_FAIL(scene, loadScene(folder_ / "scene" / "level.gltf", {}));
    EXPECT_EQ(scene.materials[0].baseColor, Vec4(kMissingColor, 0.5f * kMissingColor, kMissingColor, 0.25f));
    EXPECT_EQ(scene.materials[0].emission, Vec3(0.0f));
    ASSERT_FALSE(scene.report.warnings.empty());
    EXPECT_TRUE(mentions(scene.report.warnings[0], texture == 0 ? "gone.png" : "KHR_texture_basisu"));
  }
}

TEST_F(GltfFiles, LightBeyondFloatsIsCut) {
  write(folder_ / "scene" / "here.bin", binText());
  builder_.json["buffers"] = {{{"uri", "here.bin"}, {"byteLength", builder_.bin.size()}}};
  builder_.json["materials"] = {{{"name", "glow"},
                                 {"emissiveFactor", {1, 1, 1}},
                                 {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 1e38}}}}}}};
  write(folder_ / "scene" / "level.gltf", builder_.json.dump());
  LOAD_OR_FAIL(scene, loadScene(folder_ / "scene" / "level.gltf", {}));
  EXPECT_EQ(scene.materials[0].emission, Vec3(kMostIntensity));
  ASSERT_EQ(scene.report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene.report.warnings[0], "material 'glow' is brighter than 1e32"));
}

TEST_F(GltfFiles, PathsStayInTheScenesFolderUnlessAllowed) {
  write(folder_ / "outside.bin", binText());
  LoadOptions allow;
  allow.allowOutsidePaths = true;
  for (const std::string& uri :
       {std::string("../outside.bin"), (folder_ / "outside.bin").string(), std::string("x/../../outside.bin")}) {
    EXPECT_TRUE(mentions(errorOf(loadWith(uri)), "leaves the scene's folder")) << uri;
    EXPECT_EQ(errorOf(loadWith(uri, allow)), "(it loads)") << uri;
  }
  fs::create_symlink(folder_ / "outside.bin", folder_ / "scene" / "link.bin");
  EXPECT_TRUE(mentions(errorOf(loadWith("link.bin")), "leaves the scene's folder"));
  EXPECT_TRUE(mentions(errorOf(loadWith("file:///etc/passwd", allow)), "is not a relative path"));
  fs::create_directories(folder_ / "scene" / "sub");
  write(folder_ / "scene" / "sub" / "in.bin", binText());
  EXPECT_EQ(errorOf(loadWith("sub/../sub/in.bin")), "(it loads)");
}

TEST_F(GltfFiles, WrongExtensionAndMissingFile) {
  EXPECT_TRUE(mentions(errorOf(loadScene(folder_ / "level.fbx")),
                       "level.fbx: is not a scene file that can be read; use .gltf, .glb or .obj"));
  EXPECT_TRUE(mentions(errorOf(loadScene(folder_ / "level.glb")), "level.glb: no such file"));
  EXPECT_TRUE(mentions(errorOf(loadScene(folder_ / "scene.glb")), "no such file"));
  fs::create_directories(folder_ / "dir.glb");
  EXPECT_TRUE(mentions(errorOf(loadScene(folder_ / "dir.glb")), "is not a file"));
}

TEST_F(GltfFiles, MissingTexturesAreWarningsAndOutsideOnesErrors) {
  write(folder_ / "scene" / "b.bin", binText());
  builder_.json["meshes"][0]["primitives"][0]["material"] = 0;
  builder_.json["materials"] = {
      {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"baseColorFactor", {0.5, 0.25, 0.125, 1}}}}}};
  builder_.json["textures"] = {{{"source", 0}}};
  builder_.json["images"] = {{{"uri", "gone.png"}}};
  auto scene = loadWith("b.bin");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene->report.warnings[0], "images/0: "));
  EXPECT_TRUE(mentions(scene->report.warnings[0], "gone.png: no such file"));
  EXPECT_TRUE(scene->images[0].encoded.empty());
  EXPECT_EQ(scene->materials[0].baseColor, Vec4(kMissingColor * Vec3(0.5f, 0.25f, 0.125f), 1.0f));
  write(folder_ / "scene" / "gone.png", "not a picture");
  scene = loadWith("b.bin");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(scene->images[0].encoded.empty());
  builder_.json["images"][0]["uri"] = "../gone.png";
  EXPECT_TRUE(mentions(errorOf(loadWith("b.bin")), "images/0/uri: '../gone.png' leaves the scene's folder"));
}

}  // namespace
}  // namespace lumel
