// lumel export --for ENGINE: numbers in each engine's own terms, against closed forms and the bake. Where light comes
// from is known: a sun over a floor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "lightmap/formats/rgb9e5.h"
#include "scene/images/image_io.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr float kHalf = 0.70710678f;

/// A floor under a sun that shines along (-1, -1, 0): light comes from (1, 1, 0) / sqrt(2).
void bakeSunnyFloor(const fs::path& dir, const std::vector<std::string>& more) {
  json gltf = gltfOf({floorQuad()});
  gltf["extensionsUsed"] = {"KHR_lights_punctual"};
  gltf["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "directional"}, {"intensity", 3.0}}};
  // Its -z is the direction that the light travels in.
  gltf["nodes"].push_back({{"name", "Sun"},
                           {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}},
                           {"matrix", {0, 0, -1, 0, -kHalf, kHalf, 0, 0, kHalf, kHalf, 0, 0, 0, 5, 0, 1}}});
  gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size() - 1);
  writeFile(dir / "floor.gltf", gltf.dump());
  std::vector<std::string> arguments = {"bake", dir / "floor.gltf", "-o", dir / "bake", "--page-size",
                                        "32",   "--samples",        "16", "--dilate",   "0"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Outcome outcome = run(arguments);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
}

void exportFor(const fs::path& dir, const std::string& engine, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"export", dir / "bake", "-o", dir / engine, "--for", engine};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Outcome outcome = run(arguments);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto files = readFolder(dir / engine);
  EXPECT_TRUE(files.count("README.md"));
  for (const auto& name : json::parse(files.at("export.json"))["files"]) EXPECT_TRUE(files.count(name)) << name;
}

json glbJson(const fs::path& file) {
  const std::string bytes = readFile(file);
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data() + 12, 4);
  return json::parse(bytes.substr(20, size));
}

Image mustRead(const fs::path& file) {
  auto image = readImage(file);
  EXPECT_TRUE(image) << image.error().message;
  return image ? std::move(image->image) : Image(1, 1, 4);
}

TEST(ExportForGodot, LayersAreDirectionsInTheWorldAndUsersAreNodes) {
  const auto dir = scratch();
  bakeSunnyFloor(dir, {"--encoding", "rnm,sh1"});
  exportFor(dir, "godot");
  const Image layers = mustRead(dir / "godot" / "lightmap.exr");
  const Image flat = mustRead(dir / "bake" / "lightmap-0-flat.exr");
  ASSERT_EQ(layers.height, 4 * 32);
  // A sun has L0 = 1/4 of its irradiance / pi, c = w / 2; along the normal c is what makes the flat map exact.
  const float expected[3] = {(4.0f * kHalf - 1.0f) / 8.0f + 0.5f, 0.5f, 2.0f * kHalf / 8.0f + 0.5f};      // y, z, x
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(layers.rgb(16, 32 * (k + 1) + 16).x, expected[k], 1e-3f) << k;  // halves
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c) {
        const float constant = layers.rgb(x, y)[c];
        const float up = (layers.rgb(x, 32 + y)[c] - 0.5f) * 2.0f;
        // The engine's decode on the floor's normal; halves round each factor by 5e-4, times 4.
        ASSERT_NEAR(constant + up * constant * 4.0f, flat.rgb(x, y)[c], 3e-3f * flat.rgb(x, y)[c]);
      }
  const std::string resource = readFile(dir / "godot" / "lightmap.tres");
  for (const char* part : {"type=\"LightmapGIData\"", "uses_spherical_harmonics = true",
                           "_uses_packed_directional = true", "Rect2(0, 0, 1, 1), 0, -1", "\"bounds\": AABB("})
    EXPECT_TRUE(mentions(resource, part));
  const json glb = glbJson(dir / "godot" / "scene.glb");
  for (const json& node : glb["nodes"])
    if (node.contains("mesh")) {
      EXPECT_TRUE(mentions(resource, "NodePath(\"../scene/" + node["name"].get<std::string>() + "\")"));
    }
  EXPECT_FALSE(glb.contains("extensions"));  // the sun is in the maps
  EXPECT_TRUE(mentions(readFile(dir / "godot" / "lightmap.exr.import"), "slices/vertical=4"));
}

TEST(ExportForGodot, WithoutBandsOrWithRawRnmItIsFlatOrConverted) {
  const auto dir = scratch();
  bakeSunnyFloor(dir, {});
  exportFor(dir, "godot");
  EXPECT_EQ(mustRead(dir / "godot" / "lightmap.exr").height, 32);
  EXPECT_TRUE(mentions(readFile(dir / "godot" / "lightmap.tres"), "uses_spherical_harmonics = false"));
  bakeSunnyFloor(dir, {"--projection", "raw"});
  exportFor(dir, "godot");
  EXPECT_EQ(mustRead(dir / "godot" / "lightmap.exr").height, 4 * 32);
}

TEST(ExportForUnity, DirectionsAndTablesAreInItsWorld) {
  const auto dir = scratch();
  bakeSunnyFloor(dir, {"--encoding", "sh1"});
  exportFor(dir, "unity");
  const Image directions = mustRead(dir / "unity" / "lightmap-0-dir.png");
  ASSERT_EQ(directions.channels, 4);
  const float* texel = directions.at(16, 16);
  const float expected[4] = {0.5f - 0.5f * kHalf, 0.5f + 0.5f * kHalf, 0.5f, 0.5f + 0.5f * kHalf};
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(texel[c], expected[c], 0.003f) << c;  // a step of 8 bits
  // The engine's decode on the normal (0, 1, 0) gives the flat map.
  EXPECT_NEAR((texel[1] - 0.5f + 0.5f) / texel[3], 1.0f, 0.01f);
  const Image flat = mustRead(dir / "bake" / "lightmap-0-flat.exr"),
              color = mustRead(dir / "unity" / "lightmap-0-flat.exr");
  EXPECT_NEAR(color.rgb(16, 16).x, flat.rgb(16, 16).x, 1e-3f * flat.rgb(16, 16).x);
  const json about = readJson(dir / "unity" / "export.json");
  EXPECT_EQ(about["objects"][0]["scaleOffset"], json({1.0, 1.0, 0.0, 0.0}));
  EXPECT_TRUE(mentions(readFile(dir / "unity" / "LumelLightmaps.cs"), "lightmapScaleOffset"));
}

/// Word number `i` of a file.
std::uint32_t wordOf(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, 4);
  return word;
}

TEST(ExportForBevy, VolumesAreAmbientCubesWithTheirPositiveHalfFirst) {
  const auto dir = scratch();
  bakeSunnyFloor(dir, {"--volume", "-0.5", "0.5", "-0.5", "0.5", "1.5", "0.5", "--cell", "0.5", "--volume-samples",
                       "64", "--sky-color", "1", "1", "1"});
  exportFor(dir, "bevy");
  const std::string file = readFile(dir / "bevy" / "volume-0.ktx2");
  EXPECT_EQ(wordOf(file, 12), 123u);  // E5B9G9R9
  EXPECT_EQ(wordOf(file, 20), 3u);
  EXPECT_EQ(wordOf(file, 24), 6u);
  EXPECT_EQ(wordOf(file, 28), 9u);
  const std::uint32_t data = wordOf(file, 80);
  for (int face = 0; face < 6; ++face) {
    const Image cube = mustRead(dir / "bake" / ("volume-0-cube" + std::to_string(face) + ".exr"));
    const int axis = face / 2, half = face % 2;
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          const std::size_t texel = static_cast<std::size_t>(((axis * 3 + z) * 6 + half * 3 + y) * 3 + x);
          const Vec3 seen = colorFromRgb9e5(wordOf(file, data + 4 * texel));
          const Vec3 wanted = cube.rgb(x, y + 3 * z);
          const float most = std::max({wanted.x, wanted.y, wanted.z});
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(seen[c], wanted[c], most / 512.0f) << face;  // half a step of 9 bits
        }
  }
  const json volume = readJson(dir / "bevy" / "export.json")["volumes"][0];
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(volume["scale"][axis].get<double>(), 1.5, 1e-6);  // three cells of half a metre about three points
    EXPECT_NEAR(volume["translation"][axis].get<double>(), axis == 1 ? 1.0 : 0.0, 1e-6);
  }
  const json object = readJson(dir / "bevy" / "export.json")["objects"][0];
  EXPECT_EQ(object["min"], json({0.0, 0.0}));
  EXPECT_EQ(object["max"], json({1.0, 1.0}));
}

TEST(ExportForThree, EachNodeHasOnePageAndMapsAreHalves) {
  const auto dir = scratch();
  // Two pages: their charts do not fit on one.
  ASSERT_EQ(run({"bake", LUMEL_SOURCE_DIR "/scenes/cornell.gltf", "-o", dir / "bake", "--page-size", "64", "--samples",
                 "16", "--texels-per-meter", "15"})
                .exitCode,
            0);
  const std::size_t pages = readJson(dir / "bake" / "bake.json")["pages"].size();
  ASSERT_GT(pages, 1u);
  exportFor(dir, "three");
  const json glb = glbJson(dir / "three" / "scene.glb"), about = readJson(dir / "three" / "export.json");
  std::set<std::string> names;
  std::set<int> seenPages;
  for (const json& node : glb["nodes"]) {
    EXPECT_TRUE(names.insert(node["name"]).second) << node["name"];
    if (!node.contains("mesh")) continue;
    for (const json& primitive : glb["meshes"][node["mesh"].get<std::size_t>()]["primitives"])
      EXPECT_FALSE(primitive.contains("extras") && primitive["extras"].contains("lumel") &&
                   primitive["extras"]["lumel"].contains("page") &&
                   primitive["extras"]["lumel"]["page"] != node["extras"]["lumel"]["page"]);
    seenPages.insert(node["extras"]["lumel"]["page"].get<int>());
  }
  EXPECT_EQ(seenPages.size(), pages);
  EXPECT_EQ(about["maps"].size(), 4 * pages);
  for (const json& map : about["maps"]) {
    EXPECT_EQ(map["texels"], "half");
    EXPECT_LT(map["relativeRmse"].get<double>(), 1e-3);
  }
  EXPECT_EQ(run({"info", dir / "three" / "scene.glb"}).exitCode, 0);
  const Outcome wrong = run({"export", dir / "bake", "-o", dir / "x", "--for", "three", "--format", "dds"});
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_TRUE(mentions(wrong.err, "--format: the engine's own is written with --for"));
}

}  // namespace
}  // namespace lumel::cli
