// lumel export: what other programs read of it is what the bake holds. DDS files are judged by OpenImageIO's reader.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/images/image_io.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"

namespace lumel::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCornell = LUMEL_SOURCE_DIR "/scenes/cornell.gltf";

void bakeCornell(const fs::path& out, std::vector<std::string> options = {}) {
  options.insert(options.begin(),
                 {"bake", kCornell, "-o", out, "--page-size", "128", "--samples", "32", "--block-align", "4"});
  const Outcome outcome = run(options);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
}

struct Difference {
  double rms = 0;    // over covered texels, over the mean of the first image
  double ratio = 0;  // of the means
};

Difference differenceOf(const Image& map, const Image& seen, const LoadedImage& aux) {
  const auto coverage = static_cast<std::size_t>(
      std::find(aux.channelNames.begin(), aux.channelNames.end(), "coverage") - aux.channelNames.begin());
  double squares = 0, sum = 0, seenSum = 0, count = 0;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      if (!(aux.image.at(x, y)[coverage] > 0.0f)) continue;
      for (int c = 0; c < 3; ++c) {
        const double a = static_cast<double>(map.at(x, y)[c]), b = static_cast<double>(seen.at(x, y)[c]);
        squares += (a - b) * (a - b);
        sum += a;
        seenSum += b;
        ++count;
      }
    }
  return {std::sqrt(squares / count) / (sum / count), seenSum / sum};
}

LoadedImage mustRead(const fs::path& file) {
  auto image = readImage(file);
  EXPECT_TRUE(image) << image.error().message;
  return image ? *std::move(image) : LoadedImage{};
}

TEST(Export, BlocksOfBc6hReadByOpenImageIoAreNearToTheBake) {
  const auto dir = scratch();
  bakeCornell(dir / "bake", {"--page-size", "256"});
  const Outcome outcome = run({"export", dir / "bake", "-o", dir / "dds", "--format", "dds"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const LoadedImage aux = mustRead(dir / "bake" / "lightmap-0-aux.exr");
  const auto description = readJson(dir / "dds" / "export.json");
  for (const char* map : {"rnm0", "rnm1", "rnm2", "flat"}) {
    const LoadedImage baked = mustRead(dir / "bake" / ("lightmap-0-" + std::string(map) + ".exr"));
    const LoadedImage seen = mustRead(dir / "dds" / ("lightmap-0-" + std::string(map) + ".dds"));
    ASSERT_EQ(seen.image.width, 256);
    const Difference difference = differenceOf(baked.image, seen.image, aux);
    // What is asked for of BC6H at 8 bits a texel; the maps of rnm have harder edges, and it falls with the page's
    // size.
    EXPECT_LT(difference.rms, std::string(map) == "flat" ? 0.008 : 0.01) << map;
    EXPECT_NEAR(difference.ratio, 1.0, 1e-4) << map;
    // What export.json states is what another reader finds. It is over the flat map's mean.
    for (const auto& row : description["maps"])
      if (row["map"] == map && std::string(map) == "flat") {
        EXPECT_NEAR(row["relativeRmse"].get<double>(), difference.rms, 1e-5);
        EXPECT_EQ(row["levels"], 9);
        EXPECT_EQ(row["texels"], "bc6h");
      }
  }
}

TEST(Export, SignedMapsTakeSignedBlocksOrAreRefused) {
  const auto dir = scratch();
  bakeCornell(dir / "bake", {"--encoding", "sh1"});
  const LoadedImage aux = mustRead(dir / "bake" / "lightmap-0-aux.exr");
  ASSERT_EQ(run({"export", dir / "bake", "-o", dir / "dds", "--format", "dds"}).exitCode, 0);
  const LoadedImage baked = mustRead(dir / "bake" / "lightmap-0-sh1-x.exr");
  const LoadedImage seen = mustRead(dir / "dds" / "lightmap-0-sh1-x.dds");
  ASSERT_LT(*std::min_element(baked.image.pixels.begin(), baked.image.pixels.end()), 0.0f);
  double squares = 0, reference = 0;
  for (std::size_t i = 0; i < baked.image.pixels.size(); ++i) {
    if (!(aux.image.pixels[i / 3 * static_cast<std::size_t>(aux.image.channels)] > 0.0f)) continue;
    const double difference = static_cast<double>(baked.image.pixels[i] - seen.image.pixels[i]);
    squares += difference * difference;
    reference += static_cast<double>(baked.image.pixels[i] * baked.image.pixels[i]);
  }
  EXPECT_LT(std::sqrt(squares / reference), 0.02);  // signed numbers have one bit less
  for (const std::vector<std::string>& format :
       {std::vector<std::string>{"--format", "png-rgbm"}, {"--format", "ktx2", "--texels", "rgb9e5"}}) {
    std::vector<std::string> arguments = {"export", dir / "bake", "-o", dir / "refused"};
    arguments.insert(arguments.end(), format.begin(), format.end());
    const Outcome refused = run(arguments);
    EXPECT_EQ(refused.exitCode, 2);
    EXPECT_TRUE(mentions(refused.err, "maps of sh1 may be negative"));
    EXPECT_TRUE(mentions(refused.err, "--flat-only"));
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
    EXPECT_FALSE(fs::exists(dir / "refused"));
    arguments.push_back("--flat-only");
    EXPECT_EQ(run(arguments).exitCode, 0);
    fs::remove_all(dir / "refused");
  }
}

TEST(Export, RgbmAndHalvesSayHowToReadThem) {
  const auto dir = scratch();
  bakeCornell(dir / "bake");
  const LoadedImage aux = mustRead(dir / "bake" / "lightmap-0-aux.exr");
  const LoadedImage baked = mustRead(dir / "bake" / "lightmap-0-flat.exr");
  ASSERT_EQ(run({"export", dir / "bake", "-o", dir / "png", "--format", "png-rgbm", "--rgbm-range", "64"}).exitCode, 0);
  const LoadedImage png = mustRead(dir / "png" / "lightmap-0-flat.png");
  ASSERT_EQ(png.image.channels, 4);
  EXPECT_EQ(std::stof(png.metadata.at("lumel:rgbmRange")), 64.0f);
  Image seen(png.image.width, png.image.height, 3);
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float root = png.image.at(x, y)[3] * png.image.at(x, y)[c];
        seen.at(x, y)[c] = 64.0f * root * root;
      }
  EXPECT_LT(differenceOf(baked.image, seen, aux).rms,
            0.006);  // half a step of 8 bits, squared, at a 200th of the range
  ASSERT_EQ(run({"export", dir / "bake", "-o", dir / "png", "--format", "exr-half"}).exitCode, 0);
  EXPECT_FALSE(fs::exists(dir / "png" / "lightmap-0-flat.png"));  // of the export before
  const LoadedImage half = mustRead(dir / "png" / "lightmap-0-flat.exr");
  EXPECT_EQ(half.bitsPerChannel, 16);
  EXPECT_LT(differenceOf(baked.image, half.image, aux).rms, 5e-4);
  const Outcome small =
      run({"export", dir / "bake", "-o", dir / "small", "--format", "png-rgbm", "--rgbm-range", "0.01"});
  EXPECT_EQ(small.exitCode, 2);
  EXPECT_TRUE(mentions(small.err, "more than --rgbm-range"));
  EXPECT_FALSE(fs::exists(dir / "small"));
}

TEST(Export, MistakesAreOneLineAndTheBakeIsSafe) {
  const auto dir = scratch();
  bakeCornell(dir / "bake");
  const auto before = readFolder(dir / "bake");
  const Outcome onto = run({"export", dir / "bake", "-o", dir / "bake"});
  EXPECT_EQ(onto.exitCode, 2);
  EXPECT_TRUE(mentions(onto.err, "holds a bake"));
  const Outcome none = run({"export", dir / "nothing", "-o", dir / "out"});
  EXPECT_EQ(none.exitCode, 3);
  EXPECT_TRUE(mentions(none.err, "give the folder that lumel bake -o wrote"));
  const Outcome encoding = run({"export", dir / "bake", "-o", dir / "out", "--encoding", "zh3"});
  EXPECT_EQ(encoding.exitCode, 3);
  EXPECT_TRUE(mentions(encoding.err, "holds rnm and not zh3"));
  // What would say nothing is refused.
  for (const std::vector<std::string>& idle : {std::vector<std::string>{"--format", "exr-half", "--texels", "bc6h"},
                                               {"--format", "png-rgbm", "--no-mips"},
                                               {"--rgbm-range", "8"},
                                               {"--flat-only", "--encoding", "rnm"},
                                               {"--for", "bevy", "--encoding", "rnm"},
                                               {"--for", "three", "--format", "dds"},
                                               {"--for", "godot", "--texels", "half"},
                                               {"--keep-lights"}}) {
    std::vector<std::string> arguments = {"export", dir / "bake", "-o", dir / "out"};
    arguments.insert(arguments.end(), idle.begin(), idle.end());
    const Outcome refused = run(arguments);
    EXPECT_EQ(refused.exitCode, 2) << idle[0];
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
  EXPECT_EQ(readFolder(dir / "bake"), before);
  EXPECT_FALSE(fs::exists(dir / "out"));
  // Equal bytes for any number of threads.
  for (const char* threads : {"1", "2"})
    ASSERT_EQ(run({"export", dir / "bake", "-o", dir / threads, "--threads", threads}).exitCode, 0);
  EXPECT_EQ(readFolder(dir / "1"), readFolder(dir / "2"));
}

}  // namespace
}  // namespace lumel::cli
