// A scene of tiles whose lightmap UVs are each tile's own, as a user bakes it.
#include <gtest/gtest.h>

#include "scene/load/load_scene.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

using Json = nlohmann::json;

/// `count` tiles of a square metre side by side under a lamp; one is mirrored, one is turned and larger.
Json tiles(int count) {
  Json json = gltfOf({{{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, {0.05f, 0.05f}, {0.95f, 0.95f}}});
  const Json node = json["nodes"][0];
  json["nodes"] = Json::array();
  json["scenes"][0]["nodes"] = Json::array();
  for (int i = 0; i < count; ++i) {
    Json tile = node;
    tile["name"] = "tile " + std::to_string(i);
    tile["translation"] = {2 * i, 0, 0};
    if (i == 1) tile["scale"] = {-1, 1, 1};
    if (i == 2) {
      tile["rotation"] = {0, 0.70710678, 0, 0.70710678};
      tile["scale"] = {1.5, 1.5, 1.5};
    }
    json["nodes"].push_back(tile);
    json["scenes"][0]["nodes"].push_back(i);
  }
  return json;
}

Outcome bake(const std::filesystem::path& scene, const std::filesystem::path& out, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"bake",        scene, "-o",          out,   "--samples",          "4",
                                        "--bounces",   "1",   "--page-size", "128", "--texels-per-meter", "16",
                                        "--sky-color", "1",   "1",           "1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run(arguments);
}

TEST(ObjectUvsBake, BothFormsOfTheSceneReadTheSameTexels) {
  const auto dir = scratch();
  writeFile(dir / "tiles.gltf", tiles(6).dump());
  const Outcome placed = bake(dir / "tiles.gltf", dir / "placed");
  ASSERT_EQ(placed.exitCode, 0) << placed.err;
  EXPECT_TRUE(mentions(placed.err, "TEXCOORD_1 of 6 objects is each object's own"));
  EXPECT_FALSE(mentions(placed.err, "warning"));
  ASSERT_EQ(bake(dir / "tiles.gltf", dir / "flat", {"--flatten"}).exitCode, 0);
  for (const char* map : {"flat", "rnm0", "rnm1", "rnm2", "aux"}) {
    const std::string name = std::string("lightmap-0-") + map + ".exr";
    EXPECT_EQ(readFile(dir / "placed" / name), readFile(dir / "flat" / name)) << map;
  }
  const auto instanced = loadScene(dir / "placed" / "scene.glb");
  const auto flattened = loadScene(dir / "flat" / "scene.glb");
  ASSERT_TRUE(instanced && flattened);
  EXPECT_EQ(instanced->meshes.size(), 1u);
  EXPECT_EQ(flattened->meshes.size(), 6u);
  const Json rows = readJson(dir / "placed" / "bake.json").at("objects").at("rows");
  ASSERT_EQ(rows.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const Instance& instance = instanced->instances[i];
    const Primitive& p = instanced->primitive(instance.mesh, 0);
    const Primitive& q = flattened->primitive(flattened->instances[i].mesh, 0);
    EXPECT_EQ(instance.lightmapPageOf(p), 0);
    EXPECT_EQ(flattened->instances[i].lightmapPageOf(q), 0);
    EXPECT_EQ(rows[i][1], instance.name);
    EXPECT_EQ(rows[i][3][0].get<float>(), instance.lightmap.scale.x);
    EXPECT_EQ(rows[i][4][1].get<float>(), instance.lightmap.offset.y);
    // The same points of the world have the same places on the page, whatever the order of vertices.
    for (std::size_t v = 0; v < p.positions.size(); ++v) {
      const Vec3 world(instance.worldFromObject * Vec4(p.positions[v], 1));
      bool found = false;
      for (std::size_t w = 0; w < q.positions.size(); ++w)
        found = found || (q.positions[w] == world && q.uvSets[1][w] == instance.lightmap.apply(p.uvSets[1][v]));
      EXPECT_TRUE(found) << i << ' ' << v;
    }
  }
}

TEST(ObjectUvsBake, StillsOfBothFormsAreTheSame) {
  const auto dir = scratch();
  writeFile(dir / "tiles.gltf", tiles(3).dump());
  ASSERT_EQ(bake(dir / "tiles.gltf", dir / "placed").exitCode, 0);
  ASSERT_EQ(bake(dir / "tiles.gltf", dir / "flat", {"--flatten"}).exitCode, 0);
  for (const char* form : {"placed", "flat"}) {
    const Outcome still =
        run({"render", dir / form, "-o", dir / (std::string(form) + ".exr"), "--width", "48", "--height", "24", "--spp",
             "4", "--camera-position", "2", "6", "3", "--look-at", "2", "0", "0"});
    ASSERT_EQ(still.exitCode, 0) << still.err;
  }
  const Outcome compared = run({"diff", dir / "placed.exr", dir / "flat.exr", "--json"});
  ASSERT_EQ(compared.exitCode, 0) << compared.err;
  // Frames and UVs go through float transforms in one form only.
  const auto figures = Json::parse(compared.out).dump();
  const auto at = figures.find("\"relativeRmse\":");
  ASSERT_NE(at, std::string::npos) << figures;
  EXPECT_LT(std::stod(figures.substr(at + 15)), 1e-4) << figures;
}

/// Where the tiles' rectangles begin, in texels.
std::vector<Vec2> cornersOf(const std::filesystem::path& out) {
  const Json json = readJson(out / "bake.json");
  std::vector<Vec2> corners;
  for (const Json& row : json.at("objects").at("rows")) {
    const Json& page = json.at("pages").at(row[2].get<std::size_t>());
    corners.emplace_back(row[4][0].get<float>() * page.at("width").get<float>(),
                         row[4][1].get<float>() * page.at("height").get<float>());
  }
  return corners;
}

TEST(ObjectUvsBake, RectanglesStayWhereTheyWere) {
  const auto dir = scratch();
  writeFile(dir / "a.gltf", tiles(5).dump());
  writeFile(dir / "b.gltf", tiles(6).dump());
  ASSERT_EQ(bake(dir / "a.gltf", dir / "out").exitCode, 0);
  const std::vector<Vec2> before = cornersOf(dir / "out");
  const Outcome second = bake(dir / "b.gltf", dir / "out", {"--layout-from", dir / "out"});
  ASSERT_EQ(second.exitCode, 0) << second.err;
  EXPECT_TRUE(mentions(second.err, "5 of 6 charts"));
  const std::vector<Vec2> after = cornersOf(dir / "out");
  ASSERT_EQ(after.size(), 6u);
  // Offsets are floats of the page: a ten thousandth of a texel.
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LT(glm::length(after[i] - before[i]), 1e-4f) << i;
}

TEST(ObjectUvsBake, InfoSaysWhatBakeWillDo) {
  const auto dir = scratch();
  writeFile(dir / "tiles.gltf", tiles(6).dump());
  const std::string scene = dir / "tiles.gltf";
  EXPECT_TRUE(mentions(run({"info", scene, "--texels-per-meter", "16", "--page-size", "128"}).out,
                       "TEXCOORD_1 of 6 objects is each object's own"));
  const Outcome pages = run({"info", scene, "--uv", "scene", "--page-size", "128", "--json"});
  EXPECT_EQ(Json::parse(pages.out).at("estimate").at("pages"), 6);
  EXPECT_TRUE(mentions(run({"info", scene, "--uv", "generate"}).out, "charts are generated for 6 objects"));
  EXPECT_TRUE(mentions(run({"info", scene, "--texels-per-meter", "1000", "--page-size", "128", "--uv", "generate"}).out,
                       "trianglesLongerThanAPage"));
}

TEST(ObjectsOption, BakesTheNamedAlone) {
  const auto dir = scratch();
  writeFile(dir / "tiles.gltf", tiles(4).dump());
  ASSERT_EQ(bake(dir / "tiles.gltf", dir / "out", {"--objects", "tile 0,tile 3"}).exitCode, 0);
  const Json rows = readJson(dir / "out" / "bake.json").at("objects").at("rows");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][1], "tile 0");
  EXPECT_EQ(rows[1][1], "tile 3");
  ASSERT_EQ(bake(dir / "tiles.gltf", dir / "all", {"--objects", "tile*"}).exitCode, 0);
  EXPECT_EQ(readJson(dir / "all" / "bake.json").at("objects").at("rows").size(), 4u);
  const Outcome unknown = bake(dir / "tiles.gltf", dir / "none", {"--objects", "tile 0,tile 9"});
  EXPECT_EQ(unknown.exitCode, 2);
  EXPECT_TRUE(mentions(unknown.err, "tile 9"));
}

}  // namespace
}  // namespace lumel::cli
