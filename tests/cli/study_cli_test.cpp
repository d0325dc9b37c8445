// lumel study as a user runs it.
#include <gtest/gtest.h>

#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

TEST(StudyCommand, WritesTablesAndPlots) {
  const auto dir = scratch();
  const auto out = dir / "study";
  const Outcome outcome = run({"study", LUMEL_SOURCE_DIR "/scenes/cornell.gltf", "-o", out, "--page-size", "32",
                               "--reference-samples", "128", "--max-samples", "16", "--time-budget", "0"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_TRUE(mentions(outcome.out, "| gather | 16 (draft) |"));
  const auto files = readFolder(out);
  ASSERT_EQ(files.size(), 6u);  // no hidden folder is left
  EXPECT_EQ(files.at("study.md"), outcome.out);
  const auto json = readJson(out / "study.json");
  EXPECT_EQ(json["reference"]["samplesOfAHalf"], 128);
  EXPECT_GT(json["reference"]["flatError"], 0.0);
  EXPECT_EQ(json["settings"]["page-size"], 32);
  ASSERT_GE(json["points"].size(), 8u);
  for (const char* plot : {"error-rays.svg", "error-time.svg", "density.svg"}) {
    EXPECT_EQ(files.at(plot).rfind("<svg ", 0), 0u);
    EXPECT_TRUE(mentions(files.at(plot), "</svg>"));
  }
}

TEST(StudyCommand, ErrorsLeaveAnOlderStudyAsItIs) {
  const auto dir = scratch();
  writeFile(dir / "floor.gltf", gltfOf({floorQuad()}).dump());
  std::filesystem::create_directories(dir / "study");
  writeFile(dir / "study" / "study.md", "older");
  const Outcome dark = run({"study", dir / "floor.gltf", "-o", dir / "study", "--page-size", "16"});
  EXPECT_EQ(dark.exitCode, 3) << dark.err;
  EXPECT_TRUE(mentions(dark.err, "--sky-color"));
  EXPECT_EQ(readFolder(dir / "study").size(), 1u);
  EXPECT_EQ(readFile(dir / "study" / "study.md"), "older");
  EXPECT_EQ(run({"study", dir / "floor.gltf"}).exitCode, 2);
  EXPECT_EQ(run({"study", dir / "none.gltf", "-o", dir / "other"}).exitCode, 3);
}

TEST(StudyCommand, StopsWhenAsked) {
  const auto dir = scratch();
  const Outcome stopped =
      runAndInterrupt({"study", LUMEL_SOURCE_DIR "/scenes/courtyard.gltf", "-o", dir / "study", "--sky-color", "1", "1",
                       "1", "--reference-samples", "100000", "--time-budget", "0", "--page-size", "512"},
                      "study");
  EXPECT_EQ(stopped.exitCode, 130) << stopped.err;
  EXPECT_FALSE(std::filesystem::exists(dir / "study"));
}

}  // namespace
}  // namespace lumel::cli
