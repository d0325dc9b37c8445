// A disk that takes no more: whatever is written, an error of one line, nothing half written, what stood there intact.
// A limit on the size of files stands for the disk: it needs no rights, and writes fail in the same places.
#include <gtest/gtest.h>

#include "scene/images/image_io.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

constexpr std::size_t kLimit = 1024;

class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = scratch();
    // Noise does not compress: no file of it stays below the limit.
    Image noise(96, 96, 1);
    std::uint32_t state = 1;
    for (float& v : noise.pixels) v = static_cast<float>((state = state * 1664525 + 1013904223) >> 24) / 255.0f;
    ASSERT_TRUE(writeImage(folder_ / "h.png", noise, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  }

  void expectFailure(const std::vector<std::string>& arguments) {
    std::string all;
    for (const std::string& a : arguments) all += a + " ";
    const auto before = readFolder(folder_);
    const Outcome full = run(arguments, {.folder = folder_, .fileSizeLimit = kLimit});
    EXPECT_EQ(full.exitCode, 1) << all << full.err;
    EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << all << full.err;
    EXPECT_TRUE(mentions(full.err, "cannot be written")) << all << full.err;
    EXPECT_TRUE(readFolder(folder_) == before) << all;
    EXPECT_EQ(run(arguments, {.folder = folder_}).exitCode, 0) << all << "without the limit";
  }

  std::filesystem::path folder_;
};

TEST_F(FullDisk, SsbumpMaps) {
  for (const char* map : {"s.png", "s.tga", "s.tif", "s.exr", "s.dds"}) {
    writeFile(folder_ / map, "an older map");
    writeFile(folder_ / "w.png", "an older map");
    expectFailure({"ssbump", "h.png", "-o", map, "--save-weights", "w.png", "--azimuths", "4", "-q"});
  }
  // The main map's levels alone.
  writeFile(folder_ / "m.png", "an older map");
  expectFailure({"ssbump", "h.png", "-o", "m.png", "--mips", "--azimuths", "4", "-q"});
  expectFailure({"ssbump", "w.png", "--convert", "--to", "linear", "-o", "m.png", "-q"});
}

TEST_F(FullDisk, SsbumpPictures) {
  writeFile(folder_ / "sheet.png", "an older sheet");
  expectFailure({"ssbump", "h.png", "--contact-sheet", "sheet.png", "--azimuths", "4", "-q"});
  expectFailure({"ssbump", "h.png", "--study", "study", "--azimuths", "4", "-q"});
}

TEST_F(FullDisk, BakesAndStills) {
  const std::string scene = LUMEL_SOURCE_DIR "/scenes/cornell.gltf";
  const std::vector<std::string> bake{"bake", scene, "-o", "out", "--samples", "2", "--page-size", "64", "-q"};
  expectFailure(bake);  // without an older one; then with
  expectFailure(bake);
  writeFile(folder_ / "still.png", "an older still");
  for (const char* still : {"still.png", "other.exr"})
    expectFailure({"render", "out", "-o", still, "--width", "96", "-q"});
  expectFailure({"info", LUMEL_SOURCE_DIR "/scenes/courtyard.gltf", "--charts", "charts"});
}

TEST_F(FullDisk, HeatMapsAndStudies) {
  Image other(96, 96, 1, 0.5f);
  ASSERT_TRUE(writeImage(folder_ / "o.png", other, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  expectFailure({"diff", "h.png", "o.png", "-o", "heat.png"});
  expectFailure({"study", LUMEL_SOURCE_DIR "/scenes/cornell.gltf", "-o", "study", "--page-size", "32",
                 "--reference-samples", "8", "--max-samples", "4", "--time-budget", "0", "-q"});
}

}  // namespace
}  // namespace lumel::cli
