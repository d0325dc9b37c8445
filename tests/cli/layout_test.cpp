// lumel bake --layout-from: what a level build relies on when a scene is edited.
#include <gtest/gtest.h>

#include <set>

#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

using Json = nlohmann::json;

/// The box, and a second object: a square of the given size above its floor.
Json sceneWithSquare(float size) {
  std::vector<Quad> quads = boxFromInside();
  quads.push_back({{{-size, 0, -size}, {-size, 0, size}, {size, 0, size}, {size, 0, -size}}});
  return gltfOf(quads);
}

Outcome bake(const std::filesystem::path& scene, const std::filesystem::path& out, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {
      "bake",        scene, "-o",          out, "--uv", "generate", "--samples",          "1", "--bounces", "0",
      "--page-size", "128", "--sky-color", "1", "1",    "1",        "--texels-per-meter", "16"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run(arguments);
}

/// Page, turns and corner of every chart.
std::set<std::string> placesOf(const std::filesystem::path& out) {
  std::set<std::string> places;
  const Json charts = readJson(out / "bake.json").at("charts");
  EXPECT_EQ(charts.at("columns").at(5), "key");
  for (const Json& row : charts.at("rows")) places.insert(Json{row[5], row[0], row[6], row[7], row[8]}.dump());
  return places;
}

TEST(LayoutFrom, KeepsWhatDidNotChange) {
  const auto dir = scratch();
  writeFile(dir / "a.gltf", sceneWithSquare(0.5f).dump());
  writeFile(dir / "b.gltf", sceneWithSquare(0.4f).dump());
  // The first bake of a level finds no earlier one in its folder.
  const Outcome first = bake(dir / "a.gltf", dir / "out", {"--layout-from", dir / "out"});
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const auto before = placesOf(dir / "out");
  const Outcome second = bake(dir / "b.gltf", dir / "out", {"--layout-from", dir / "out"});
  ASSERT_EQ(second.exitCode, 0) << second.err;
  EXPECT_TRUE(mentions(second.err, "stay where they were"));
  const auto after = placesOf(dir / "out");
  std::size_t moved = 0;
  for (const std::string& place : after) moved += before.count(place) == 0 ? 1 : 0;
  EXPECT_EQ(moved, 1u) << "the square alone";
  EXPECT_EQ(after.size(), before.size());
}

TEST(LayoutFrom, TheSameSceneGivesTheSameUvs) {
  const auto dir = scratch();
  writeFile(dir / "a.gltf", sceneWithSquare(0.5f).dump());
  ASSERT_EQ(bake(dir / "a.gltf", dir / "one").exitCode, 0);
  ASSERT_EQ(bake(dir / "a.gltf", dir / "two", {"--layout-from", dir / "one"}).exitCode, 0);
  EXPECT_EQ(readFile(dir / "one" / "scene.glb"), readFile(dir / "two" / "scene.glb"));
}

TEST(LayoutFrom, OfOtherSettingsIsNamedAndNotUsed) {
  const auto dir = scratch();
  writeFile(dir / "a.gltf", sceneWithSquare(0.5f).dump());
  ASSERT_EQ(bake(dir / "a.gltf", dir / "one").exitCode, 0);
  const Outcome other = bake(dir / "a.gltf", dir / "two", {"--layout-from", dir / "one", "--padding", "4"});
  EXPECT_EQ(other.exitCode, 0);
  EXPECT_TRUE(mentions(other.err, "the earlier layout has another padding"));
}

TEST(LayoutFrom, ADamagedBakeIsAnInputError) {
  const auto dir = scratch();
  writeFile(dir / "a.gltf", sceneWithSquare(0.5f).dump());
  ASSERT_EQ(bake(dir / "a.gltf", dir / "one").exitCode, 0);
  const Json sound = readJson(dir / "one" / "bake.json");
  const auto refuses = [&](const char* where, const Json& json) {
    writeFile(dir / "one" / "bake.json", json.is_string() ? json.get<std::string>() : json.dump());
    const Outcome outcome = bake(dir / "a.gltf", dir / "two", {"--layout-from", dir / "one"});
    EXPECT_EQ(outcome.exitCode, 3) << where;
    EXPECT_TRUE(mentions(outcome.err, "bake.json"));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n') > 0, true);
  };
  refuses("half a file", Json(sound.dump().substr(0, 200)));
  Json damaged = sound;
  damaged["atlas"]["layout"]["padding"] = "two";
  refuses("a rule", damaged);
  damaged = sound;
  damaged["charts"]["rows"][0][5] = "not a key";
  refuses("a key", damaged);
  damaged = sound;
  damaged["charts"]["rows"][0][7] = 1e300;
  refuses("a corner", damaged);
  damaged = sound;
  damaged["charts"]["columns"] = 1;
  refuses("the columns", damaged);
  // Places that make no sense are not an error: the charts go elsewhere.
  damaged = sound;
  for (Json& row : damaged["charts"]["rows"]) row[7] = -5;
  writeFile(dir / "one" / "bake.json", damaged.dump());
  EXPECT_EQ(bake(dir / "a.gltf", dir / "two", {"--layout-from", dir / "one"}).exitCode, 0);
}

}  // namespace
}  // namespace lumel::cli
