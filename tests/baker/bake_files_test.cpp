#include "baker/files/write/bake_files.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "baker/files/read/baked_scene.h"
#include "scene/files/file_set.h"
#include "scene/images/image_io.h"
#include "tests/mentions.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

/// A bake of nothing with so many pages of 8 x 4 texels, all covered, of one value.
struct Fixture {
  Scene scene;
  AtlasResult atlas;
  BakeResult result;
  BakeRecord record;

  explicit Fixture(int pages, float value = 0.5f) {
    scene.materials.resize(1);
    for (int i = 0; i < pages; ++i) {
      BakedPage page;
      page.maps.assign(record.bakeOptions.encoding->mapCount(), Image(8, 4, 3, value));
      page.flat = Image(8, 4, 3, value);
      page.aux = Image(8, 4, 4, 1.0f);
      page.mapErrors = Image(8, 4, static_cast<int>(page.maps.size()), 0.25f);
      result.pages.push_back(page);
      atlas.atlas.pages.push_back({8, 4});
    }
  }
  Expected<void> write(const fs::path& dir) const { return writeBake(dir, scene, atlas, result, record); }
};

std::set<std::string> namesIn(const fs::path& dir) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(dir)) names.insert(entry.path().filename());
  return names;
}

TEST(BakeFiles, LightVolumesAreReadAsTheyWereWritten) {
  const fs::path dir = scratch();
  Fixture bake(1);
  LightVolume volume = volumeOf(Vec3(-1, 0, 2), Vec3(1, 1.5f, 4.5f), 0.5f);
  volume.name = "Hall";
  float value = 0.0f;
  const auto next = [&value] { return value += 0.25f; };
  for (VolumePoint& point : volume.points) {
    point.isValid = static_cast<int>(value) % 3 != 0;
    point.offset = Vec3(value, -value, 0.5f);
    for (Vec3& sh : point.harmonics) sh = Vec3(next(), -2.5f, 1.0f);
    for (Vec3& face : point.cube) face = Vec3(next(), 2.0f, -1.0f);
    for (float& sight : point.nearness) sight = next();
  }
  bake.result.volumes = {volume, volumeOf(Vec3(0.0f), Vec3(0.0f), 1.0f)};
  ASSERT_TRUE(bake.write(dir));
  const auto read = readBake(dir, {.volumes = true});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->volumes.size(), 2u);
  const LightVolume& same = read->volumes[0];
  EXPECT_EQ(same.name, "Hall");
  EXPECT_EQ(same.origin, volume.origin);
  EXPECT_EQ(same.cell, volume.cell);
  EXPECT_EQ(same.counts, volume.counts);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    EXPECT_EQ(same.points[i].isValid, volume.points[i].isValid);
    EXPECT_EQ(same.points[i].offset, volume.points[i].offset);
    EXPECT_EQ(same.points[i].harmonics, volume.points[i].harmonics);
    EXPECT_EQ(same.points[i].cube, volume.points[i].cube);
    EXPECT_EQ(same.points[i].nearness, volume.points[i].nearness);
  }
  // A bake without volumes leaves none behind, and a damaged one is named.
  std::ofstream(dir / "volume-0.json") << R"({"format": 1, "name": "", "origin": [0, 0, 0], "cell": [1, 1, 1],
      "counts": [1e9, 1e9, 1e9]})";
  const auto damaged = readBake(dir, {.volumes = true});
  ASSERT_FALSE(damaged);
  EXPECT_TRUE(mentions(damaged.error().message, "volume-0.json"));
  // Claims that memory could not hold are measured by the images, which are small.
  std::ofstream(dir / "volume-0.json") << R"({"format": 1, "name": "", "origin": [0, 0, 0], "cell": [1, 1, 1],
      "counts": [400, 400, 400]})";
  const auto claimed = readBake(dir, {.volumes = true});
  ASSERT_FALSE(claimed);
  EXPECT_TRUE(mentions(claimed.error().message, "volume-0-points.exr"));
  ASSERT_TRUE(Fixture(1).write(dir));
  EXPECT_EQ(namesIn(dir).count("volume-0.json") + namesIn(dir).count("volume-0-sh0.exr"), 0u);
}

TEST(BakeFiles, SmallerBakeReplacesALargerOneAndLeavesOtherFilesAlone) {
  const fs::path dir = scratch();
  Fixture large(2);
  large.scene.environment.image = Image(4, 2, 3, 1.0f);
  ASSERT_TRUE(large.write(dir));
  EXPECT_EQ(namesIn(dir).size(), 2u * 5u + 3u);  // images, sky.exr, scene.glb, bake.json
  for (const char* foreign : {"notes.txt", "lightmap-x-rnm0.exr", "lightmap-1-rnm0.png"})
    std::ofstream(dir / foreign) << "mine";
  ASSERT_TRUE(Fixture(1).write(dir));
  const auto names = namesIn(dir);
  EXPECT_EQ(names, (std::set<std::string>{"bake.json", "scene.glb", "lightmap-0-rnm0.exr", "lightmap-0-rnm1.exr",
                                          "lightmap-0-rnm2.exr", "lightmap-0-flat.exr", "lightmap-0-aux.exr",
                                          "notes.txt", "lightmap-x-rnm0.exr", "lightmap-1-rnm0.png"}));
}

TEST(BakeFiles, FailureLeavesTheOldResult) {
  const fs::path dir = scratch();
  ASSERT_TRUE(Fixture(1).write(dir));
  const auto before = fs::last_write_time(dir / "bake.json");
  Fixture broken(1);
  broken.record.half = true;
  broken.result.pages[0].flat.pixels[5] = 1e6f;  // beyond what half holds
  const auto written = broken.write(dir);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::Failed);
  EXPECT_TRUE(mentions(written.error().message, "65504"));
  EXPECT_EQ(fs::last_write_time(dir / "bake.json"), before);
  EXPECT_EQ(namesIn(dir).size(), 7u);
}

TEST(BakeFiles, RemovesWhatAKilledBakeLeft) {
  const fs::path dir = scratch();
  fs::create_directories(dir / ".lumel-999999999.part");  // beyond the largest process number of Linux
  fs::create_directories(dir / ".lumel-mine.part");
  ASSERT_TRUE(Fixture(1).write(dir));
  EXPECT_FALSE(fs::exists(dir / ".lumel-999999999.part"));
  EXPECT_TRUE(fs::exists(dir / ".lumel-mine.part"));
}

TEST(BakeFiles, PutsBackWhatABakeKilledBetweenItsRenamesWasReplacing) {
  const fs::path dir = scratch();
  ASSERT_TRUE(Fixture(1, 0.25f).write(dir));
  const auto names = namesIn(dir);
  // As such a bake leaves it: the old files in its hidden folder, new ones half in place.
  const fs::path old = dir / ".lumel-999999999.part" / "old";
  const fs::path oldLast = dir / ".lumel-999999999.part" / "old-last";
  fs::create_directories(old);
  fs::create_directories(oldLast);
  for (const std::string& name : names) fs::rename(dir / name, (name == "bake.json" ? oldLast : old) / name);
  std::ofstream(dir / "lightmap-0-flat.exr") << "new";
  EXPECT_FALSE(readBake(dir)) << "no mixture is taken for a bake";
  FileSet::recover(dir);
  EXPECT_EQ(namesIn(dir), names);
  const auto baked = readBake(dir);
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->meanFlat, Vec3(0.25f));
  // With the new bake.json in place the new bake is whole, and what it replaced may go.
  fs::create_directories(oldLast);
  std::ofstream(oldLast / "bake.json") << "old";
  FileSet::recover(dir);
  EXPECT_EQ(namesIn(dir), names);
  EXPECT_TRUE(readBake(dir));
}

TEST(BakeFiles, AFolderInTheWayOfAFileLeavesTheOldResult) {
  const fs::path dir = scratch();
  ASSERT_TRUE(Fixture(1, 0.25f).write(dir));
  fs::create_directories(dir / "lightmap-1-flat.exr" / "inside");
  const auto written = Fixture(2, 0.5f).write(dir);
  ASSERT_FALSE(written);
  EXPECT_TRUE(mentions(written.error().message, "lightmap-1-flat.exr"));
  EXPECT_TRUE(fs::exists(dir / "lightmap-1-flat.exr" / "inside"));
  EXPECT_EQ(namesIn(dir).size(), 8u);
  const auto baked = readBake(dir);
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->meanFlat, Vec3(0.25f));
}

TEST(BakeFiles, ReadBackIsWhatWasWritten) {
  const fs::path dir = scratch();
  Fixture fixture(2, 0.25f);
  fixture.scene.environment.image = Image(4, 2, 3, 2.0f);
  fixture.scene.environment.rotationDegrees = 30.0f;
  fixture.scene.environment.strength = 0.5f;
  ASSERT_TRUE(fixture.write(dir));
  const auto baked = readBake(dir);
  ASSERT_TRUE(baked) << baked.error().message;
  ASSERT_EQ(baked->pages.size(), 2u);
  EXPECT_EQ(baked->pages[1][2].pixels, fixture.result.pages[1].maps[2].pixels);
  EXPECT_EQ(baked->encoding->conventions(), fixture.record.bakeOptions.encoding->conventions());
  EXPECT_EQ(baked->meanFlat, Vec3(0.25f));
  EXPECT_EQ(baked->scene.environment.rotationDegrees, 30.0f);
  EXPECT_EQ(baked->scene.environment.strength, 0.5f);
  EXPECT_EQ(baked->scene.environment.image.pixels, fixture.scene.environment.image.pixels);
}

/// Writes bake.json anew after change(json).
template <class Change>
void changeBakeJson(const fs::path& dir, const Change& change) {
  auto json = readBakeJson(dir);
  ASSERT_TRUE(json) << json.error().message;
  change(*json);
  std::ofstream(dir / "bake.json") << *json;
}

TEST(BakeFiles, EncodingMapsAndDecodeAreNamed) {
  const fs::path dir = scratch();
  Fixture fixture(1);
  fixture.record.bakeOptions.encoding = sh1Encoding();
  fixture.result.pages[0].maps.assign(4, Image(8, 4, 3, -0.5f));
  ASSERT_TRUE(fixture.write(dir));
  const auto json = readBakeJson(dir);
  ASSERT_TRUE(json);
  EXPECT_EQ(json->at("encoding").at("name"), "sh1");
  EXPECT_EQ(json->at("encoding").at("maps"), nlohmann::ordered_json(sh1Encoding()->mapNames()));
  EXPECT_EQ(json->at("encoding").at("signed"), true);
  EXPECT_TRUE(mentions(json->at("conventions").at("decodeFormula"), "L0 + N.x Lx"));
  EXPECT_EQ(json->at("pages")[0].at("files").at("sh1").size(), 4u);
  const auto image = readImage(dir / "lightmap-0-sh1-x.exr");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->metadata.at("lumel:encoding"), "sh1");
  EXPECT_EQ(image->metadata.at("lumel:maps"), "sh1-0 sh1-x sh1-y sh1-z");
  EXPECT_EQ(image->metadata.at("lumel:decode"), "sh1");
  EXPECT_EQ(image->image.pixels[0], -0.5f);
  // A bake of other maps takes their place.
  ASSERT_TRUE(Fixture(1).write(dir));
  EXPECT_FALSE(fs::exists(dir / "lightmap-0-sh1-x.exr"));
}

TEST(BakeFiles, ABakeFromBeforeEncodingsWereNamedIsOneOfRnm) {
  const fs::path dir = scratch();
  const Fixture fixture(1, 0.25f);
  ASSERT_TRUE(fixture.write(dir));
  changeBakeJson(dir, [](auto& json) {
    json.erase("encoding");
    json["conventions"]["decode"] = "linear";
  });
  const auto baked = readBake(dir);
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->encoding->name(), "rnm");
  EXPECT_EQ(baked->encoding->conventions().at("decode"), "linear");
  EXPECT_EQ(baked->pages[0].size(), 3u);
}

TEST(BakeFiles, AnEncodingThatIsNotKnownIsNamedWithTheVersionThatHasIt) {
  const fs::path dir = scratch();
  ASSERT_TRUE(Fixture(1).write(dir));
  changeBakeJson(dir, [](auto& json) {
    json["encoding"]["name"] = "sh9";
    json["lumel"] = "7.8.9";
  });
  const auto baked = readBake(dir);
  ASSERT_FALSE(baked);
  EXPECT_EQ(baked.error().kind, ErrorKind::Input);
  for (const char* word : {"bake.json", "'sh9'", "7.8.9"})
    EXPECT_TRUE(mentions(baked.error().message, word)) << baked.error().message;
}

TEST(BakeFiles, DamagedResultsAreNamed) {
  const fs::path dir = scratch();
  const auto fails = [&](const std::string& word) {
    const auto baked = readBake(dir);
    return !baked && baked.error().kind == ErrorKind::Input && baked.error().message.find(word) != std::string::npos;
  };
  ASSERT_TRUE(Fixture(1).write(dir));
  fs::remove(dir / "lightmap-0-rnm1.exr");
  EXPECT_TRUE(fails("lightmap-0-rnm1.exr"));
  std::ofstream(dir / "bake.json") << "{\"format\": 1}";
  EXPECT_TRUE(fails("/conventions is missing"));
  std::ofstream(dir / "bake.json") << "{\"format\": 99}";
  EXPECT_TRUE(fails("format"));
  std::ofstream(dir / "bake.json") << "{\"form";
  EXPECT_TRUE(fails("not valid JSON"));
}

TEST(BakeFiles, CheckWritableLeavesNothing) {
  const fs::path dir = scratch() / "new";
  EXPECT_TRUE(checkWritable(dir / "a" / "b"));
  EXPECT_FALSE(fs::exists(dir));
  fs::create_directories(dir);
  EXPECT_TRUE(checkWritable(dir));
  EXPECT_TRUE(namesIn(dir).empty());
  std::ofstream(dir / "file") << "x";
  EXPECT_FALSE(checkWritable(dir / "file"));
  EXPECT_FALSE(checkWritable(dir / "file" / "below"));
}

}  // namespace
}  // namespace lumel
