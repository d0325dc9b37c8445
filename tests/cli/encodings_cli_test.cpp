// Encodings as a user asks for them: in a bake, in stills, comparisons and conversions, and in a study.
#include <gtest/gtest.h>

#include <algorithm>

#include "scene/images/image_io.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCornell = LUMEL_SOURCE_DIR "/scenes/cornell.gltf";

Outcome bake(const fs::path& out, std::vector<std::string> options) {
  options.insert(options.begin(), {"bake", kCornell, "-o", out, "--page-size", "64", "--samples", "16"});
  return run(options);
}

/// Root mean square of the difference of two stills over that of the second.
double relativeError(const fs::path& a, const fs::path& b) {
  const auto json = nlohmann::json::parse(run({"diff", a, b, "--json"}).out, nullptr, false);
  return json.at(0).at("all").at("relativeRmse").get<double>();
}

TEST(Encodings, OneBakeHasThemAllAndStillsTakeTheOneThatIsNamed) {
  const auto dir = scratch();
  const Outcome outcome = bake(dir / "out", {"--encoding", "rnm,flat,sh1,h4,zh3,ahd,dominant"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto json = readJson(dir / "out" / "bake.json");
  EXPECT_EQ(json["encoding"]["name"], "rnm");
  ASSERT_EQ(json["encodings"].size(), 7u);
  for (const auto& encoding : json["encodings"]) {
    const std::string name = encoding["name"];
    for (const char* key : {"basis", "order", "decode", "decodeFormula"})
      EXPECT_TRUE(encoding["conventions"].contains(key)) << name;
    for (const std::string map : encoding["maps"]) {
      const auto image = readImage(dir / "out" / ("lightmap-0-" + map + ".exr"));
      ASSERT_TRUE(image) << image.error().message;
      if (map == "flat") continue;  // two of them read it
      EXPECT_EQ(image->metadata.at("lumel:encoding"), name);
      EXPECT_EQ(image->metadata.at("lumel:decode"), encoding["conventions"]["decode"]);
    }
    ASSERT_EQ(run({"render", dir / "out", "-o", dir / (name + ".exr"), "--encoding", name, "--width", "64", "--height",
                   "64", "--spp", "1"})
                  .exitCode,
              0)
        << name;
  }
  // Walls without normal maps get the light of flat normals, which all of them hold exactly; between texels directions
  // are blended, which bends the last two a little.
  for (const char* name : {"rnm", "sh1", "h4", "zh3"})
    EXPECT_LT(relativeError(dir / (std::string(name) + ".exr"), dir / "flat.exr"), 1e-3) << name;
  for (const char* name : {"ahd", "dominant"})
    EXPECT_LT(relativeError(dir / (std::string(name) + ".exr"), dir / "flat.exr"), 0.02) << name;
  const Outcome other = bake(dir / "some", {"--encoding", "sh1"});
  ASSERT_EQ(other.exitCode, 0) << other.err;
  EXPECT_FALSE(fs::exists(dir / "some" / "lightmap-0-rnm0.exr"));
  const Outcome missing = run({"render", dir / "some", "-o", dir / "x.png", "--encoding", "rnm"});
  EXPECT_EQ(missing.exitCode, 3);
  EXPECT_TRUE(mentions(missing.err, "the bake holds sh1 and not rnm; bake with --encoding sh1,rnm"));
  // What both have is compared.
  const auto common = nlohmann::json::parse(run({"diff", dir / "out", dir / "some", "--json"}).out, nullptr, false);
  EXPECT_EQ(common.size(), 5u);  // four maps of sh1 and the flat one
}

TEST(Encodings, MistakesAreOneLine) {
  const auto dir = scratch();
  for (const auto& [list, words] :
       {std::pair("rnm,sh9", "--encoding: 'sh9' is not one of rnm, flat, sh1"),
        std::pair("sh1,rnm,sh1", "--encoding: sh1 is there twice"), std::pair("", "--encoding: '' is not one of")}) {
    const Outcome outcome = bake(dir / "out", {"--encoding", list});
    EXPECT_EQ(outcome.exitCode, 2);
    EXPECT_TRUE(mentions(outcome.err, words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  EXPECT_EQ(bake(dir / "out", {"--encoding", "zh3", "--seams", "on"}).exitCode, 2);
  const Outcome help = run({"bake", "--help"});
  for (const char* name : {"rnm", "flat", "sh1", "h4", "zh3", "ahd", "dominant"})
    EXPECT_TRUE(mentions(help.out, "\n  " + std::string(name) + " "));
}

TEST(Encodings, ABakeOfRawRnmIsConverted) {
  const auto dir = scratch();
  ASSERT_EQ(bake(dir / "out", {"--projection", "raw", "--half", "--samples", "64"}).exitCode, 0);
  const auto before = readFolder(dir / "out");
  const Outcome outcome = run({"convert", dir / "out", "--to", "sh1"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto after = readFolder(dir / "out");
  EXPECT_EQ(after.size(), before.size() + 4);
  for (const auto& [name, bytes] : before)
    if (name != "bake.json") {
      EXPECT_EQ(after.at(name), bytes) << name;
    }
  const auto json = readJson(dir / "out" / "bake.json");
  EXPECT_EQ(json["encodings"][1]["name"], "sh1");
  EXPECT_EQ(json["pages"][0]["files"]["sh1"].size(), 4u);
  const auto map = readImage(dir / "out" / "lightmap-0-sh1-x.exr");
  ASSERT_TRUE(map);
  EXPECT_EQ(map->metadata.at("lumel:encoding"), "sh1");
  EXPECT_EQ(map->metadata.at("lumel:convertedFrom"), "rnm");
  EXPECT_EQ(map->bitsPerChannel, 16);
  // Flat normals get the flat map's light, whatever the conversion is off by on others. (Halfs round by 5e-4.)
  for (const char* mode : {"lit", "flat"})
    ASSERT_EQ(run({"render", dir / "out", "-o", dir / (std::string(mode) + ".exr"), "--encoding", "sh1", "--mode", mode,
                   "--width", "64", "--height", "64", "--spp", "1"})
                  .exitCode,
              0);
  EXPECT_LT(relativeError(dir / "lit.exr", dir / "flat.exr"), 1e-3);
  const Outcome again = run({"convert", dir / "out", "--to", "sh1"});
  EXPECT_EQ(again.exitCode, 3);
  EXPECT_TRUE(mentions(again.err, "holds sh1 already"));
  ASSERT_EQ(bake(dir / "usual", {}).exitCode, 0);
  const Outcome usual = run({"convert", dir / "usual", "--to", "sh1"});
  EXPECT_EQ(usual.exitCode, 3);
  EXPECT_TRUE(mentions(usual.err, "--projection raw"));
}

TEST(Encodings, AStudyComparesThem) {
  const auto dir = scratch();
  const Outcome outcome =
      run({"study", kCornell, "-o", dir / "study", "--encodings", "--page-size", "32", "--max-samples", "64"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_EQ(readFolder(dir / "study").size(), 2u);
  EXPECT_EQ(readFile(dir / "study" / "encodings.md"), outcome.out);
  std::map<std::string, nlohmann::json> rows;
  const auto json = readJson(dir / "study" / "encodings.json");
  for (const auto& row : json["encodings"]) rows[row["encoding"]] = row;
  ASSERT_EQ(rows.size(), 10u);  // rnm signed, sh1 fit and sh1 converted as well
  EXPECT_EQ(rows["zh3"]["bytesPerTexelFloat"], 60);
  for (const auto& [name, row] : rows) {
    EXPECT_GT(row["errorWithin30"], 0.0) << name;
    EXPECT_GT(row["errorWithin60"], row["errorWithin30"]) << name;
    if (name == "flat") continue;
    EXPECT_LT(row["errorWithin60"], rows["flat"]["errorWithin60"]) << name;  // what more maps are for
  }
  EXPECT_LT(rows["zh3"]["errorWithin60"], rows["sh1"]["errorWithin60"]);
  EXPECT_EQ(rows["ahd"]["negativeLight"], 0.0);
  // Lines that are near to irradiance itself are nearer than two bands of it.
  for (const char* line : {"h4", "sh1 fit", "sh1 converted"})
    EXPECT_LT(rows[line]["errorWithin60"], rows["sh1"]["errorWithin60"]) << line;
  EXPECT_NEAR(rows["sh1 fit"]["errorWithin60"], rows["h4"]["errorWithin60"].get<double>(), 1e-5);  // the same functions
}

}  // namespace
}  // namespace lumel::cli
