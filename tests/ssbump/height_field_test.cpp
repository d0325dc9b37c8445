#include "ssbump/occlusion/height_field.h"

#include <gtest/gtest.h>

#include <limits>

#include "ssbump/basis_file.h"
#include "ssbump/maps/weights.h"
#include "ssbump/occlusion/bilateral.h"
#include "tests/mentions.h"
#include "tests/scratch.h"
#include "tests/ssbump/fields.h"

#include <filesystem>
#include <fstream>

namespace lumel::ssbump {
namespace {

LoadedImage loaded(int width, int height, std::vector<std::string> names, float fill = 0.25f) {
  LoadedImage l;
  l.image = Image(width, height, static_cast<int>(names.size()), fill);
  l.channelNames = std::move(names);
  l.bitsPerChannel = 8;
  return l;
}

TEST(HeightField, ScaleIsInTexelsOrPercentOfTheWidth) {
  HeightOptions options;
  ASSERT_TRUE(parseHeightScale("24", options));
  EXPECT_EQ(heightFieldFromImage(loaded(8, 4, {"Y"}), options, "h")->texels[0], 6.0f);
  ASSERT_TRUE(parseHeightScale("50%", options));
  EXPECT_EQ(heightFieldFromImage(loaded(8, 4, {"Y"}), options, "h")->texels[0], 1.0f);
  options.invert = true;
  EXPECT_EQ(heightFieldFromImage(loaded(8, 4, {"Y"}), options, "h")->texels[0], 3.0f);
  for (const char* bad : {"", "%", "ten", "5 %", "nan", "1e999"})
    EXPECT_EQ(parseHeightScale(bad, options).error().kind, ErrorKind::Usage) << bad;
}

TEST(HeightField, ChannelsByNameIndexAndLuminance) {
  LoadedImage l = loaded(1, 1, {"R", "G", "B", "A"});
  l.image.pixels = {0.1f, 0.2f, 0.3f, 0.9f};
  HeightOptions options{.channel = "", .scale = 1, .scaleIsPercent = false};
  const auto value = [&](const char* channel) {
    options.channel = channel;
    return heightFieldFromImage(LoadedImage(l), options, "h")->texels[0];
  };
  EXPECT_FLOAT_EQ(value(""), 0.1f);
  EXPECT_FLOAT_EQ(value("A"), 0.9f);
  EXPECT_FLOAT_EQ(value("alpha"), 0.9f);
  EXPECT_FLOAT_EQ(value("g"), 0.2f);
  EXPECT_FLOAT_EQ(value("2"), 0.3f);
  EXPECT_FLOAT_EQ(value("luminance"), luminance({0.1f, 0.2f, 0.3f}));
  for (const char* bad : {"4", "-1", "Z", "Alph"})
    EXPECT_EQ(findChannel(l, bad, "h").error().kind, ErrorKind::Input) << bad;
}

TEST(HeightField, BadInputIsNamed) {
  const HeightOptions texels{.channel = "", .scale = 10, .scaleIsPercent = false};
  LoadedImage nan = loaded(4, 4, {"Y"});
  nan.image.pixels[6] = NAN;
  auto bad = heightFieldFromImage(std::move(nan), texels, "h.exr");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().kind, ErrorKind::Input);
  EXPECT_TRUE(mentions(bad.error().message, "(2, 1)"));
  LoadedImage infinite = loaded(4, 4, {"Y"});
  infinite.image.pixels[0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(heightFieldFromImage(std::move(infinite), texels, "h"));

  LoadedImage palette = loaded(4, 4, {"R", "G", "B"});
  palette.paletted = true;
  EXPECT_TRUE(heightFieldFromImage(LoadedImage(palette), texels, "h")) << "a table of greys is grey";
  palette.image.pixels[4] = 0.9f;
  EXPECT_TRUE(mentions(heightFieldFromImage(std::move(palette), texels, "h").error().message, "indexed"));

  auto channel = heightFieldFromImage(loaded(4, 4, {"R", "G", "B"}), {.channel = "A", .scale = 1}, "h");
  EXPECT_TRUE(mentions(channel.error().message, "R, G, B"));

  auto huge = heightFieldFromImage(loaded(4, 4, {"Y"}), {.channel = "", .scale = 1e9, .scaleIsPercent = false}, "h");
  EXPECT_TRUE(mentions(huge.error().message, "--height-scale"));
  auto zero = heightFieldFromImage(loaded(4, 4, {"Y"}), {.channel = "", .scale = 0, .scaleIsPercent = false}, "h");
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->highest, 0);
}

TEST(HeightField, ANormalMapIsRecognised) {
  LoadedImage normals = loaded(32, 32, {"R", "G", "B"});
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      normals.image.setRgb(x, y, encodeNormal(heightNormal(fields::fractal(32, 32, 3), x, y), Green::Up));
  EXPECT_TRUE(looksLikeNormalMap(normals.image));
  EXPECT_TRUE(mentions(heightFieldFromImage(LoadedImage(normals), {}, "n.png").error().message, "normal map"));
  EXPECT_TRUE(heightFieldFromImage(LoadedImage(normals), {.channel = "B"}, "n.png"))
      << "a chosen channel is taken at its word";
  // Grey heights and a noisy picture are none.
  LoadedImage grey = loaded(32, 32, {"R", "G", "B"});
  for (std::size_t i = 0; i < grey.image.pixels.size(); ++i)
    grey.image.pixels[i] = fields::hashUnit(static_cast<std::uint32_t>(i / 3), 0, 0);
  EXPECT_FALSE(looksLikeNormalMap(grey.image));
  for (std::size_t i = 0; i < grey.image.pixels.size(); ++i)
    grey.image.pixels[i] = fields::hashUnit(static_cast<std::uint32_t>(i), 0, 0);
  EXPECT_FALSE(looksLikeNormalMap(grey.image));
}

TEST(HeightField, NormalsLeanAwayFromTheSlope) {
  const HeightField east = fields::make(8, 8, false, [](int x, int) { return static_cast<float>(x); });
  EXPECT_NEAR(heightNormal(east, 4, 4).x, -std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(heightNormal(east, 0, 4).x, -std::sqrt(0.5), 1e-6) << "one-sided at the edge";
  const HeightField up =
      fields::make(8, 8, false, [](int, int y) { return static_cast<float>(-y); });  // rises up the image
  EXPECT_NEAR(heightNormal(up, 4, 4).y, -std::sqrt(0.5), 1e-6);
}

TEST(Bilateral, SmoothsStairStepsAndKeepsEdges) {
  // A ramp in steps of 1 every 8 texels beside a cliff of 50.
  HeightField field = fields::make(
      128, 16, false, [](int x, int) { return std::floor(static_cast<float>(x) / 8) + (x >= 64 ? 50.0f : 0.0f); });
  const HeightField before = field;
  bilateralFilter(field, 6, 2.5f);
  float roughBefore = 0, roughAfter = 0;
  for (int x = 16; x < 48; ++x) {
    const auto bend = [&](const HeightField& f) { return std::abs(f.at(x - 1, 8) - 2 * f.at(x, 8) + f.at(x + 1, 8)); };
    roughBefore += bend(before);
    roughAfter += bend(field);
  }
  EXPECT_LT(roughAfter, 0.4f * roughBefore);
  EXPECT_NEAR(field.at(64, 8) - field.at(63, 8), 51, 1.5) << "the cliff stays";
}

TEST(Bilateral, LeavesFlatFieldsAloneAndWraps) {
  HeightField flat = fields::make(9, 7, true, [](int, int) { return 1.3f; });
  bilateralFilter(flat, 3, 1);
  for (float h : flat.texels) EXPECT_EQ(h, 1.3f);
  const HeightField a = fields::fractal(32, 32, 10);
  HeightField moved = fields::make(32, 32, true, [&](int x, int y) { return a.at(x + 13, y + 5); }), filtered = a;
  bilateralFilter(moved, 3, 2);
  bilateralFilter(filtered, 3, 2);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) ASSERT_EQ(moved.at(x, y), filtered.at(x + 13, y + 5));
}

TEST(BasisFile, ReadsUnitVectorsAndNamesBadLines) {
  const auto folder = scratch();
  const auto write = [&](const char* text) {
    std::ofstream(folder / "basis.txt") << text;
    return readBasis(folder / "basis.txt");
  };
  const auto good = write("# four\n0 0 1\n\n0.6 0 0.8 # east\n-0.6 0 0.8\n0 0.8 0.6\n");
  ASSERT_TRUE(good);
  EXPECT_EQ(good->size(), 4u);
  for (const char* bad : {"", "0 0\n", "0 0 1 1\n", "1 1 1\n", "0 0 -1\n", "a b c\n", "nan 0 1\n"})
    EXPECT_FALSE(write(bad)) << bad;
  EXPECT_TRUE(mentions(write("0 0 1\n0 0 2\n").error().message, ":2:"));
  EXPECT_FALSE(readBasis(folder / "absent.txt"));
}

}  // namespace
}  // namespace lumel::ssbump
