// lumel info --lint: a scene with sound lightmap UVs, broken in one way at a time.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

using Json = nlohmann::json;

/// Two walls of a metre side by side, 19 texels each on a page of 64, apart in the lightmap.
std::vector<Quad> twoWalls() {
  const Quad left{{{0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {0.1f, 0.1f}, {0.4f, 0.4f}};
  const Quad right{{{1, 1, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}}, {0.5f, 0.1f}, {0.8f, 0.4f}};
  return {left, right};
}

/// Normals towards the viewer for all eight vertices; tangents along x, of the second wall along `second`.
void addFrames(Json& gltf, const std::filesystem::path& dir, Vec3 second) {
  std::vector<float> values;
  for (int i = 0; i < 8; ++i) values.insert(values.end(), {0, 0, 1});
  for (int i = 0; i < 8; ++i) {
    const Vec3 t = i < 4 ? Vec3(1, 0, 0) : second;
    values.insert(values.end(), {t.x, t.y, t.z, 1});
  }
  std::string bytes(values.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  writeFile(dir / "frames.bin", bytes);
  gltf["buffers"].push_back({{"byteLength", bytes.size()}, {"uri", "frames.bin"}});
  const std::size_t view = gltf["bufferViews"].size();
  gltf["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", 0}, {"byteLength", 96}});
  gltf["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", 96}, {"byteLength", 128}});
  const std::size_t accessor = gltf["accessors"].size();
  gltf["accessors"].push_back({{"bufferView", view}, {"componentType", 5126}, {"count", 8}, {"type", "VEC3"}});
  gltf["accessors"].push_back({{"bufferView", view + 1}, {"componentType", 5126}, {"count", 8}, {"type", "VEC4"}});
  auto& attributes = gltf["meshes"][0]["primitives"][0]["attributes"];
  attributes["NORMAL"] = accessor;
  attributes["TANGENT"] = accessor + 1;
}

struct Case {
  const char* id;
  const char* unit;
  double least;  // count
  std::function<void(std::vector<Quad>&)> breakQuads;
  std::function<void(Json&, const std::filesystem::path&)> breakFile = {};
};

Json lint(const std::filesystem::path& scene) {
  const Outcome outcome =
      run({"info", scene, "--lint", "--json", "--uv", "scene", "--page-size", "64", "--padding", "2"});
  EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
  return Json::parse(outcome.out, nullptr, false).value("lint", Json());
}

Json findingOf(const Json& lint, const std::string& id) {
  for (const Json& finding : lint.value("findings", Json::array()))
    if (finding.value("id", "") == id) return finding;
  return nullptr;
}

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"overlap", "texels", 100, [](std::vector<Quad>& q) { q[1].uvLeast.x = 0.2f, q[1].uvMost.x = 0.5f; }},
      {"out-of-range", "vertices", 2, [](std::vector<Quad>& q) { q[1].uvLeast.x = 0.8f, q[1].uvMost.x = 1.1f; }},
      {"flip", "triangles", 2, [](std::vector<Quad>& q) { q[1].uvLeast.x = 0.4f, q[1].uvMost.x = 0.2f; }},
      {"lost", "triangles", 2, [](std::vector<Quad>& q) { q[1].uvMost.x = q[1].uvLeast.x; }},
      {"mirrored", "charts", 1, [](std::vector<Quad>& q) { std::swap(q[1].uvLeast.x, q[1].uvMost.x); }},
      {"sub-texel", "charts", 1, [](std::vector<Quad>& q) { q[1].uvMost = q[1].uvLeast + Vec2(0.005f); }},
      {"tiny", "charts", 1, [](std::vector<Quad>& q) { q[1].uvMost = q[1].uvLeast + Vec2(0.02f); }},
      {"density", "charts", 1, [](std::vector<Quad>& q) { q[1].uvMost = Vec2(0.98f, 0.9f); }},
      {"frame-crossing", "charts", 1, [](std::vector<Quad>& q) { q[1].uvLeast.x = 0.4f, q[1].uvMost.x = 0.7f; },
       [](Json& gltf, const std::filesystem::path& dir) {
         addFrames(gltf, dir, {0, 1, 0});
       }},
      {"gap", "charts", 2, [](std::vector<Quad>& q) { q[1].uvLeast.x = 0.42f, q[1].uvMost.x = 0.72f; }},
  };
  return all;
}

TEST(Lint, SoundUvsHaveNoFindings) {
  const auto dir = scratch();
  Json gltf = gltfOf(twoWalls());
  addFrames(gltf, dir, {1, 0, 0});
  writeFile(dir / "scene.gltf", gltf.dump());
  const Json found = lint(dir / "scene.gltf");
  EXPECT_EQ(found.value("findings", Json()), Json::array()) << found.dump(1);
  const Json& atlas = found.at("atlas");
  // 0.1 to 0.4 of 64: 6.4 to 25.6, which is 20 texels touched on each side.
  EXPECT_EQ(atlas.at("coveredTexels"), 2 * 20 * 20);
  EXPECT_EQ(atlas.at("pageTexels"), 64 * 64);
  EXPECT_EQ(atlas.at("charts"), 2);
  EXPECT_EQ(atlas.at("mapBytes"), 64 * 64 * 24);
  // More than the images of the page, less than a gigabyte.
  EXPECT_GT(atlas.at("bakeMemoryBytes"), 64 * 64 * 64);
  EXPECT_LT(atlas.at("bakeMemoryBytes"), 1 << 30);
}

TEST(Lint, NamesWhatIsBrokenAndWhere) {
  const auto dir = scratch();
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.id);
    std::vector<Quad> quads = twoWalls();
    c.breakQuads(quads);
    Json gltf = gltfOf(quads);
    if (c.breakFile) c.breakFile(gltf, dir);
    const auto file = dir / (std::string(c.id) + ".gltf");
    writeFile(file, gltf.dump());
    const Json found = lint(file);
    const Json finding = findingOf(found, c.id);
    ASSERT_TRUE(finding.is_object());
    EXPECT_GE(finding.at("count"), c.least);
    EXPECT_GE(finding.at("total"), finding.at("count"));
    EXPECT_EQ(finding.at("unit"), c.unit);
    const Json& worst = finding.at("worst");
    EXPECT_EQ(worst.at("name"), "Thing, primitive 0");
    EXPECT_EQ(worst.at("page"), 0);
    EXPECT_GE(worst.at("x"), 6);
    EXPECT_LE(worst.at("x"), 71);
    EXPECT_GE(worst.at("y"), 6);
    EXPECT_LE(worst.at("y"), 64);

    // The lines for people say the same; without --json they are what is printed.
    const std::string lines = found.at("lines").dump();
    EXPECT_TRUE(mentions(lines, std::string(": ") + c.id + ": "));
    EXPECT_TRUE(mentions(lines, "worst: Thing, primitive 0 (page 0, texel "));
  }
}

TEST(Lint, ReplacesUvsThatCannotBeUsedAndSaysSo) {
  const auto dir = scratch();
  std::vector<Quad> quads = twoWalls();
  quads[1].uvLeast = quads[0].uvLeast;
  quads[1].uvMost = quads[0].uvMost;
  writeFile(dir / "scene.gltf", gltfOf(quads).dump());
  const Outcome outcome = run({"info", dir / "scene.gltf", "--lint", "--page-size", "64"});
  EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_TRUE(mentions(outcome.out, "covered twice"));
  EXPECT_TRUE(mentions(outcome.out, "charts are generated"));
  EXPECT_TRUE(mentions(outcome.out, "texels covered"));
  EXPECT_TRUE(mentions(outcome.out, "MB while baking"));
  EXPECT_FALSE(mentions(outcome.out, ": overlap: "));
}

}  // namespace
}  // namespace lumel::cli
