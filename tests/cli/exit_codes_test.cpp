// What a user meets who makes a mistake: an exit code for scripts and one line that says what, where and what to do.
#include <gtest/gtest.h>

#include "scene/images/image_io.h"
#include "tests/cli/harness.h"

namespace lumel::cli {
namespace {

using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

/// The code, one line on standard error that starts with "lumel: " and holds the words, nothing on standard output.
AssertionResult fails(const Outcome& outcome, int exitCode, const std::vector<std::string>& words) {
  if (outcome.exitCode != exitCode)
    return AssertionFailure() << "exit code " << outcome.exitCode << ": " << outcome.err;
  const std::size_t start = outcome.err.rfind("lumel: ");
  if (start == std::string::npos || (start > 0 && outcome.err[start - 1] != '\n') || outcome.err.back() != '\n' ||
      outcome.err.find('\n', start) != outcome.err.size() - 1)
    return AssertionFailure() << "not one line at the end: " << outcome.err;
  for (const std::string& word : words)
    if (outcome.err.find(word, start) == std::string::npos)
      return AssertionFailure() << "no '" << word << "' in: " << outcome.err;
  if (!outcome.out.empty()) return AssertionFailure() << "on standard output: " << outcome.out;
  return AssertionSuccess();
}

std::string floorScene(const std::filesystem::path& dir) {
  writeFile(dir / "floor.gltf", gltfOf({floorQuad()}).dump());
  return dir / "floor.gltf";
}

TEST(ExitCodes, HelpIsThereByAnyName) {
  const Outcome alone = run({});
  EXPECT_EQ(alone.exitCode, 0) << alone.err;
  EXPECT_EQ(alone.out, run({"--help"}).out);
  EXPECT_EQ(alone.out, run({"help"}).out);
  EXPECT_EQ(run({"help", "bake"}).out, run({"bake", "--help"}).out);
  EXPECT_TRUE(fails(run({"help", "bakes"}), 2, {"unknown command 'bakes'"}));
  EXPECT_TRUE(fails(run({"help", "bake", "render"}), 2, {"one command"}));
}

TEST(ExitCodes, HelpAndVersionSucceedOnStandardOutput) {
  const Outcome version = run({"--version"});
  EXPECT_EQ(version.exitCode, 0);
  EXPECT_EQ(version.out.rfind("lumel ", 0), 0u) << version.out;
  for (const char* command : {"bake", "render", "info", "diff", "study"}) {
    const Outcome help = run({command, "--help"});
    EXPECT_EQ(help.exitCode, 0);
    EXPECT_NE(help.out.find("Usage: lumel " + std::string(command)), std::string::npos);
    EXPECT_NE(help.out.find("Example"), std::string::npos);
    EXPECT_EQ(help.err, "");
  }
  // Defaults are shown.
  const std::string help = run({"bake", "--help"}).out;
  EXPECT_NE(help.find("0: direct light only, all: as many as matter [all]"), std::string::npos);
  EXPECT_NE(help.find("a multiple of 4 [1024]"), std::string::npos);
}

TEST(ExitCodes, WrongCommandLineIs2) {
  const std::string scene = floorScene(scratch());
  const std::string out = scratch() / "out";
  EXPECT_TRUE(fails(run({"frobnicate"}), 2, {"frobnicate"}));
  EXPECT_TRUE(fails(run({"bake"}), 2, {"SCENE is missing"}));
  EXPECT_TRUE(fails(run({"bake", scene}), 2, {"--output", "missing"}));
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", scene, "-o", out});
    return run(more);
  };
  EXPECT_TRUE(fails(bake({"--smaples", "3"}), 2, {"--smaples", "did you mean --samples?"}));
  EXPECT_TRUE(fails(bake({"--samples", "0"}), 2, {"--samples", "0", "use 1"}));
  EXPECT_TRUE(fails(bake({"--samples", "many"}), 2, {"--samples", "'many'", "number"}));
  EXPECT_TRUE(fails(bake({"--samples", "99999999999"}), 2, {"--samples", "too large"}));
  EXPECT_TRUE(fails(bake({"--samples"}), 2, {"--samples", "value is missing"}));
  EXPECT_TRUE(fails(bake({"--padding", "-1"}), 2, {"--padding", "-1"}));
  EXPECT_TRUE(fails(bake({"--sky-strength", "nan"}), 2, {"--sky-strength", "finite"}));
  EXPECT_TRUE(fails(bake({"--sky-color", "1", "2"}), 2, {"--sky-color", "3"}));
  EXPECT_TRUE(fails(bake({"--sky-color", "1", "-2", "0"}), 2, {"--sky-color", "-2"}));
  EXPECT_TRUE(fails(bake({"--page-size", "30"}), 2, {"--page-size", "multiple of 4"}));
  EXPECT_TRUE(fails(bake({"--projection", "round"}), 2, {"--projection", "raw|flat|fit|signed"}));
  EXPECT_TRUE(fails(bake({"--target-error", "200%"}), 2, {"--target-error", "200%", "0% to 50%"}));
  EXPECT_TRUE(fails(bake({"--target-error", "1"}), 2, {"--target-error", "1 is", "0% to 50%"}));  // 1% is meant
  EXPECT_TRUE(fails(run({"bkae"}), 2, {"unknown command 'bkae'", "bake"}));
  EXPECT_TRUE(fails(bake({"--config", std::filesystem::temp_directory_path()}), 2, {"--config", "folder"}));
  EXPECT_TRUE(fails(bake({"--target-error", "0.1", "--samples", "99", "--max-samples", "64"}), 2,
                    {"--samples 99", "--max-samples 64"}));
  EXPECT_TRUE(fails(bake({"--max-samples", "64"}), 2, {"--max-samples", "--target-error"}));
  EXPECT_TRUE(fails(bake({"--indirect-only", "--bounces", "0"}), 2, {"--indirect-only", "--bounces 0"}));
  EXPECT_TRUE(fails(run({"info", "flat.exr", "--lint"}), 2, {"--lint", "flat.exr is none"}));
  EXPECT_TRUE(fails(bake({"--sky", "x.hdr", "--sky-color", "1", "1", "1"}), 2, {"--sky-color"}));
  EXPECT_TRUE(fails(run({"render", out, "-o", "still.bmp"}), 2, {"still.bmp", ".png"}));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ExitCodes, OutputOverItsOwnInputIs2AndLosesNothing) {
  const std::filesystem::path folder = scratch();
  const std::string scene = floorScene(folder);
  const std::filesystem::path level = folder / "level";
  ASSERT_EQ(run({"bake", scene, "-o", level, "--samples", "1", "--page-size", "16"}).exitCode, 0);
  std::filesystem::copy_file(level / "lightmap-0-flat.exr", folder / "flat.exr");
  std::filesystem::copy_file(level / "lightmap-0-flat.exr", folder / "sky.exr");
  const auto before = readFolder(level);
  EXPECT_TRUE(fails(run({"bake", level / "scene.glb", "-o", level}), 2, {"scene.glb", "input"}));
  EXPECT_TRUE(fails(run({"bake", level / "../level/scene.glb", "-o", level}), 2, {"scene.glb", "input"}));
  EXPECT_TRUE(fails(run({"bake", scene, "--sky", folder / "sky.exr", "-o", folder}), 2, {"sky.exr", "input"}));
  EXPECT_TRUE(fails(run({"render", level, "-o", level / "lightmap-0-flat.exr"}), 2, {"lightmap-0-flat.exr", "input"}));
  EXPECT_EQ(readFolder(level), before);
  const std::string flat = folder / "flat.exr";
  const std::string content = readFile(flat);
  EXPECT_TRUE(fails(run({"diff", level / "lightmap-0-flat.exr", flat, "-o", flat}), 2, {"flat.exr", "input"}));
  EXPECT_TRUE(fails(run({"ssbump", flat, "-o", flat}), 2, {"flat.exr", "input"}));
  EXPECT_TRUE(fails(run({"ssbump", scene, "-o", folder / "s.exr", "--mask", flat, "--save-ao", flat}), 2,
                    {"flat.exr", "input"}));
  EXPECT_EQ(readFile(flat), content);
  // Files of a bake that are no input here are replaced as ever.
  EXPECT_EQ(run({"bake", scene, "-o", level, "--samples", "1", "--page-size", "16"}).exitCode, 0);
}

TEST(ExitCodes, WrongInputIs3) {
  const auto dir = scratch();
  const std::string out = dir / "out";
  EXPECT_TRUE(fails(run({"bake", dir / "none.gltf", "-o", out}), 3, {"none.gltf"}));
  writeFile(dir / "broken.gltf", "{\"asset\":");
  EXPECT_TRUE(fails(run({"bake", dir / "broken.gltf", "-o", out}), 3, {"broken.gltf"}));
  nlohmann::json unknown = gltfOf({floorQuad()});
  unknown["extensionsUsed"] = unknown["extensionsRequired"] = {"EXT_from_the_future"};
  unknown["nodes"][0]["extensions"]["EXT_from_the_future"] = nlohmann::json::object();
  writeFile(dir / "future.gltf", unknown.dump());
  EXPECT_TRUE(fails(run({"bake", dir / "future.gltf", "-o", out}), 3, {"future.gltf", "EXT_from_the_future"}));
  EXPECT_TRUE(fails(run({"bake", floorScene(dir), "-o", out, "--sky", dir / "none.hdr"}), 3, {"none.hdr"}));
  std::filesystem::create_directory(dir / "folder");
  EXPECT_TRUE(fails(run({"bake", dir / "folder", "-o", out}), 3, {"folder: is not a file but a folder"}));
  EXPECT_TRUE(fails(run({"bake", floorScene(dir), "-o", out, "--sky", dir / "folder"}), 3, {"is a folder"}));
  writeFile(dir / "empty.glb", "");
  EXPECT_TRUE(fails(run({"bake", dir / "empty.glb", "-o", out}), 3, {"empty.glb", "is empty"}));
  writeFile(dir / "notes.txt", "not a picture");
  EXPECT_TRUE(fails(run({"info", dir / "notes.txt"}), 3, {"notes.txt: is no image of a known kind"}));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_TRUE(fails(run({"render", dir, "-o", dir / "still.png"}), 3, {"bake.json"}));
  EXPECT_TRUE(fails(run({"info", dir / "none.exr"}), 3, {"none.exr"}));
  EXPECT_TRUE(fails(run({"diff", dir / "none.exr", dir / "none.exr"}), 3, {"none.exr"}));
}

TEST(ExitCodes, NothingToBakeIsAWarning) {
  const auto dir = scratch();
  nlohmann::json gltf = gltfOf({floorQuad()});
  for (auto& mesh : gltf["meshes"])
    for (auto& primitive : mesh["primitives"]) primitive["mode"] = 1;  // lines
  writeFile(dir / "lines.gltf", gltf.dump());
  const Outcome outcome = run({"bake", dir / "lines.gltf", "-o", dir / "out", "--sky-color", "1", "1", "1"});
  EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("no triangle of the scene gets a lightmap"), std::string::npos) << outcome.err;
}

TEST(ExitCodes, StrictIs4AndWritesAllTheSame) {
  const auto dir = scratch();
  const std::string scene = floorScene(dir);
  const std::vector<std::string> plain = {"--samples", "4", "--page-size", "16"};
  const auto bakeTo = [&](const std::string& out, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"bake", scene, "-o", dir / out};
    arguments.insert(arguments.end(), plain.begin(), plain.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  // Without a light there is a warning.
  EXPECT_EQ(bakeTo("a", {}).exitCode, 0);
  EXPECT_TRUE(fails(bakeTo("b", {"--strict"}), 4, {"--strict: 1 warning", "bake.json"}));
  EXPECT_EQ(readFile(dir / "a" / "lightmap-0-flat.exr"), readFile(dir / "b" / "lightmap-0-flat.exr"));
  EXPECT_EQ(bakeTo("c", {"--strict", "--sky-color", "1", "1", "1"}).exitCode, 0);
  // A sky of 1e5 nits is beyond halfs: known before the bake, and cut.
  const Outcome half = bakeTo("d", {"--half", "--sky-color", "100000", "100000", "100000"});
  EXPECT_EQ(half.exitCode, 0) << half.err;
  EXPECT_NE(half.err.find("the sky alone brings 1e+05, and --half ends at 65504"), std::string::npos) << half.err;
  EXPECT_NE(half.err.find("are cut to it"), std::string::npos) << half.err;
}

TEST(ExitCodes, OutputThatCannotBeWrittenIs1BeforeTheWork) {
  const auto dir = scratch();
  const std::string scene = floorScene(dir);
  // A file stands where the folder should be; so many samples would take hours.
  const Outcome outcome =
      run({"bake", scene, "-o", scene + "/out", "--samples", "1000000", "--sky-color", "1", "1", "1"});
  EXPECT_TRUE(fails(outcome, 1, {"floor.gltf/out", "cannot be written"}));
}

TEST(Config, CommandLineWinsOverConfigOverDefaults) {
  const auto dir = scratch();
  floorScene(dir);
  std::filesystem::create_directory(dir / "settings");
  // Paths are relative to the file, tables of other commands are left alone, a table of this one counts.
  writeFile(dir / "settings" / "bake.toml",
            "scene = \"../floor.gltf\"\nsamples = 3\nsky-color = [1, 0.5, 0]\n[bake]\nseed = 7\n[render]\nspp = 4\n");
  const Outcome outcome = run(
      {"bake", "--config", dir / "settings" / "bake.toml", "-o", dir / "out", "--samples", "5", "--page-size", "64"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto settings = readJson(dir / "out" / "bake.json")["settings"];
  EXPECT_EQ(settings["samples"], 5);
  EXPECT_EQ(settings["seed"], 7);
  EXPECT_EQ(settings["sky-color"], nlohmann::json({1.0, 0.5, 0.0}));
  EXPECT_EQ(settings["bounces"], "all");
  EXPECT_EQ(settings["projection"], "flat");
}

// A command line can take back the limit that a config file sets, and the other way round.
TEST(Config, BouncesGoBackToAll) {
  const auto dir = scratch();
  const std::string scene = floorScene(dir);
  const auto bouncesOf = [&](const std::string& toml, const std::vector<std::string>& more) {
    writeFile(dir / "bake.toml", toml);
    std::vector<std::string> arguments = {"bake", scene,         "-o", dir / "out", "--samples",
                                          "1",    "--page-size", "64", "--config",  dir / "bake.toml"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    return readJson(dir / "out" / "bake.json")["settings"]["bounces"];
  };
  EXPECT_EQ(bouncesOf("bounces = 2\n", {}), 2);
  EXPECT_EQ(bouncesOf("bounces = 2\n", {"--bounces", "all"}), "all");
  EXPECT_EQ(bouncesOf("bounces = \"all\"\n", {}), "all");
  EXPECT_EQ(bouncesOf("bounces = \"all\"\n", {"--bounces", "0"}), 0);
  EXPECT_TRUE(fails(run({"bake", scene, "-o", dir / "out", "--bounces=-1"}), 2, {"--bounces", "-1", "'all'"}));
  EXPECT_TRUE(fails(run({"bake", scene, "-o", dir / "out", "--bounces", "some"}), 2, {"--bounces", "'all'"}));
}

TEST(Config, MistakesAre2WithFileAndLine) {
  const auto dir = scratch();
  const std::string scene = floorScene(dir);
  const auto bakeWith = [&](const std::string& toml) {
    writeFile(dir / "bake.toml", toml);
    return run({"bake", scene, "-o", dir / "out", "--config", dir / "bake.toml"});
  };
  EXPECT_TRUE(fails(bakeWith("seed = 1\nsampels = 3\n"), 2, {"bake.toml:2:", "sampels", "did you mean 'samples'?"}));
  EXPECT_TRUE(fails(bakeWith("\n\nsamples = 0\n"), 2, {"bake.toml:3:", "samples", "use 1"}));
  EXPECT_TRUE(fails(bakeWith("sky-color = [1, 2]\n"), 2, {"bake.toml:1:", "3 values"}));
  EXPECT_TRUE(fails(bakeWith("samples = 1.5\n"), 2, {"bake.toml:1:", "1.5"}));
  EXPECT_TRUE(fails(bakeWith("samples == 3\n"), 2, {"bake.toml:1:"}));
  EXPECT_TRUE(fails(bakeWith("[bake]\nseed = nan\n"), 2, {"bake.toml:2:", "seed"}));
  EXPECT_TRUE(fails(run({"bake", scene, "-o", dir / "out", "--config", dir / "none.toml"}), 2, {"none.toml"}));
  EXPECT_FALSE(std::filesystem::exists(dir / "out"));
}

TEST(Info, DescribesScenesImagesAndBakes) {
  const auto dir = scratch();
  const std::string scene = floorScene(dir);
  const Outcome outcome = run({"info", scene, "--json", "--texels-per-meter", "10", "--uv", "generate"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out, nullptr, false);
  EXPECT_EQ(json["kind"], "scene");
  EXPECT_EQ(json["triangles"], 2);
  EXPECT_EQ(json["materials"].size(), 1u);
  EXPECT_EQ(json["estimate"]["texels"], 400);  // 2 m x 2 m
  // Its own TEXCOORD_1 is the whole page, whatever the density.
  const Outcome own = run({"info", scene, "--json", "--texels-per-meter", "10", "--page-size", "64"});
  EXPECT_EQ(nlohmann::json::parse(own.out, nullptr, false)["estimate"]["texels"], 64 * 64);
  // Under a sky image a bake takes what EnvironmentLight does: 12 bytes a pixel, 24 for each of 512 x 256 cells.
  ASSERT_TRUE(writeImage(dir / "sky.exr", Image(64, 32, 3, 1.0f)));
  const auto lit = nlohmann::json::parse(run({"info", scene, "--json", "--sky", dir / "sky.exr"}).out, nullptr, false);
  const auto dark = nlohmann::json::parse(run({"info", scene, "--json"}).out, nullptr, false);
  EXPECT_EQ(lit["sky"]["pixels"], nlohmann::json({64, 32}));
  EXPECT_NEAR(lit["estimate"]["bakeMemoryBytes"].get<double>() - dark["estimate"]["bakeMemoryBytes"].get<double>(),
              12 * 64 * 32 + 18 * 512 * 256, 2);
  // Without it a warning says that nothing shines.
  EXPECT_EQ(json["warnings"].size(), 1u);
  EXPECT_EQ(lit["warnings"].size(), 0u);
  nlohmann::json off = gltfOf({floorQuad()});
  off["materials"][0]["emissiveFactor"] = {1.0, 1.0, 1.0};
  off["materials"][0]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
  off["extensionsUsed"] = {"KHR_materials_unlit", "KHR_lights_punctual"};
  off["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 0.0}}};
  off["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  writeFile(dir / "off.gltf", off.dump());
  EXPECT_EQ(nlohmann::json::parse(run({"info", dir / "off.gltf", "--json"}).out, nullptr, false)["warnings"].size(),
            1u);
  // What cannot be seen gets no lightmap.
  nlohmann::json glass = gltfOf({floorQuad()});
  glass["materials"][0]["alphaMode"] = "BLEND";
  glass["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1.0, 1.0, 1.0, 0.0};
  writeFile(dir / "glass.gltf", glass.dump());
  EXPECT_EQ(nlohmann::json::parse(run({"info", dir / "glass.gltf", "--json"}).out, nullptr, false)["estimate"],
            nullptr);
  ASSERT_EQ(run({"bake", scene, "-o", dir / "out", "--samples", "1", "--page-size", "16", "--sky-color", "1", "1", "1"})
                .exitCode,
            0);
  EXPECT_NE(run({"info", dir / "out"}).out.find("decode: squared"), std::string::npos);
  const auto image =
      nlohmann::json::parse(run({"info", dir / "out" / "lightmap-0-aux.exr", "--json"}).out, nullptr, false);
  EXPECT_EQ(image["width"], 16);
  EXPECT_EQ(image["channels"]["samples"]["max"], 1.0);
  EXPECT_EQ(image["metadata"]["lumel:map"], "aux");
}

}  // namespace
}  // namespace lumel::cli
