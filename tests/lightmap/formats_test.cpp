// Formats of textures: what is written is what a reader sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "lightmap/formats/bc6h.h"
#include "lightmap/formats/chart_mips.h"
#include "lightmap/formats/rgb9e5.h"
#include "lightmap/formats/rgbm.h"
#include "lightmap/formats/texture_files.h"
#include "scene/base/half.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

TEST(Halves, AllOfThemSurviveAndRoundingIsToEven) {
  for (std::uint32_t h = 0; h < 0x10000; ++h) {
    const auto half = static_cast<std::uint16_t>(h);
    const float value = floatFromHalf(half);
    if (std::isnan(value)) continue;
    ASSERT_EQ(halfFromFloat(value), half);
  }
  EXPECT_EQ(halfFromFloat(1.0f + 0x1p-11f), 0x3c00);      // half way: to the even neighbour
  EXPECT_EQ(halfFromFloat(1.0f + 3 * 0x1p-11f), 0x3c02);  // the same upwards
  EXPECT_EQ(halfFromFloat(0x1p-25f), 0);                  // half of the least one
  EXPECT_EQ(halfFromFloat(0x1.8p-25f), 1);
  EXPECT_EQ(halfFromFloat(65519.0f), 0x7bff);
  EXPECT_EQ(halfFromFloat(65520.0f), 0x7c00);
  EXPECT_EQ(halfFromFloat(-std::numeric_limits<float>::infinity()), 0xfc00);
  EXPECT_TRUE(std::isnan(floatFromHalf(halfFromFloat(std::numeric_limits<float>::quiet_NaN()))));
}

TEST(Rgb9e5, IsWithinHalfAStepOfTheLargestChannel) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-14.0f, 15.0f), share(0.0f, 1.0f);
  for (int i = 0; i < 10000; ++i) {
    const Vec3 color = std::exp2(exponent(random)) * Vec3(share(random), share(random), share(random));
    const Vec3 seen = colorFromRgb9e5(rgb9e5FromColor(color));
    const float most = std::max({color.x, color.y, color.z});
    // 9 bits of the largest channel's octave: half of 1/256 of it, at most.
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(seen[c], color[c], most / 512.0f + 0x1p-25f);
  }
  EXPECT_EQ(rgb9e5FromColor({0, 0, 0}), 0u);
  EXPECT_EQ(colorFromRgb9e5(rgb9e5FromColor({-1, 2, 1e9f})), Vec3(0, 0, kMostRgb9e5));  // 2 is below a step of 128
  EXPECT_EQ(colorFromRgb9e5(rgb9e5FromColor({1, 0.5f, 0.25f})), Vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(colorFromRgb9e5(rgb9e5FromColor({0.99999f, 0, 0})), Vec3(1, 0, 0));  // rounds up into the next octave
}

TEST(Rgbm, StepsAreAShareOfTheValue) {
  for (float value = 64.0f; value > 0.01f; value *= 0.93f) {
    const Vec3 color(value, 0.5f * value, 0.9f * value);
    const Vec4 stored = rgbmFromColor(color, 64.0f);
    for (int c = 0; c < 4; ++c) ASSERT_EQ(stored[c] * 255.0f, std::round(stored[c] * 255.0f));
    // Half a step of 255ths in a root between .7 and 1 of the multiplier is .3% of it, and twice that of its square.
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(colorFromRgbm(stored, 64.0f)[c] / color[c], 1.0f, 0.008f) << value;
  }
  EXPECT_EQ(colorFromRgbm(rgbmFromColor({0, 0, 0}, 8.0f), 8.0f), Vec3(0.0f));
  EXPECT_EQ(colorFromRgbm(rgbmFromColor({8, 8, 8}, 8.0f), 8.0f), Vec3(8.0f));
}

/// Every mode's bits: each bit of each end point once, as many as a block has room for.
TEST(Bc6h, LayoutsNameEachBitOnce) {
  for (std::size_t i = 0; i < bc6h::kModes; ++i) {
    const bc6h::Mode& mode = bc6h::mode(i);
    const std::size_t rest = mode.regions == 2 ? 5 + 46 : 63;
    EXPECT_EQ(static_cast<std::size_t>(mode.prefixBits) + mode.bits.size() + rest, 128u) << i;
    for (std::uint8_t c = 0; c < 3; ++c)
      for (std::uint8_t point = 0; point < 2 * mode.regions; ++point)
        for (int bit = 0; bit < (point == 0 ? mode.precision : mode.deltaBits[c]); ++bit)
          EXPECT_EQ(std::ranges::count_if(
                        mode.bits,
                        [&](const bc6h::EndpointBit& b) { return b.channel == c && b.point == point && b.bit == bit; }),
                    1)
              << "mode " << i << ", channel " << int{c} << ", point " << int{point} << ", bit " << bit;
  }
}

TEST(Bc6h, WhatIsPackedIsUnpacked) {
  std::mt19937 random(2);
  const auto between = [&random](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
  for (const bool isSigned : {false, true})
    for (std::size_t index = 0; index < bc6h::kModes; ++index)
      for (int repeat = 0; repeat < 50; ++repeat) {
        const bc6h::Mode& mode = bc6h::mode(index);
        bc6h::Parts parts;
        parts.mode = index;
        parts.partition = mode.regions == 2 ? static_cast<std::size_t>(between(0, 31)) : 0;
        const int most = isSigned ? (1 << (mode.precision - 1)) - 1 : (1 << mode.precision) - 1;
        const int least = isSigned ? -most : 0;
        for (std::size_t c = 0; c < 3; ++c) {
          parts.ends[c][0] = between(least, most);
          const int reach = 1 << (mode.deltaBits[c] - 1);
          for (std::size_t point = 1; point < 2 * static_cast<std::size_t>(mode.regions); ++point)
            parts.ends[c][point] = mode.areDeltas
                                       ? std::clamp(parts.ends[c][0] + between(-reach, reach - 1), least, most)
                                       : between(least, most);
          ASSERT_TRUE(bc6h::fits(mode, parts.ends[c], c));
        }
        for (std::size_t i = 0; i < bc6h::kTexels; ++i) {
          const bool isAnchor = i == 0 || (mode.regions == 2 && static_cast<int>(i) == bc6h::anchor(parts.partition));
          parts.indices[i] =
              static_cast<std::uint8_t>(between(0, (mode.regions == 1 ? 16 : 8) / (isAnchor ? 2 : 1) - 1));
        }
        bc6h::Parts seen;
        ASSERT_TRUE(bc6h::unpack(bc6h::pack(parts), isSigned, seen));
        EXPECT_EQ(seen.mode, parts.mode);
        EXPECT_EQ(seen.partition, parts.partition);
        EXPECT_EQ(seen.ends, parts.ends);
        EXPECT_EQ(seen.indices, parts.indices);
      }
  bc6h::Block reserved{};
  reserved[0] = 0x13;
  EXPECT_EQ(bc6h::decode(reserved, false)[5], Vec3(0.0f));
}

double relativeError(const bc6h::Texels& texels, bool isSigned) {
  const auto seen = bc6h::decode(bc6h::encode(texels, isSigned), isSigned);
  double squares = 0, reference = 0;
  for (std::size_t i = 0; i < bc6h::kTexels; ++i) {
    const Vec3 off = seen[i] - texels.colors[i];
    squares += static_cast<double>(texels.weights[i] * glm::dot(off, off));
    reference += static_cast<double>(texels.weights[i] * glm::dot(texels.colors[i], texels.colors[i]));
  }
  return std::sqrt(squares / reference);
}

TEST(Bc6h, BlocksAreNearToTheirTexels) {
  bc6h::Texels even, slope, edge, dark, tint;
  for (std::size_t i = 0; i < bc6h::kTexels; ++i) {
    const float x = static_cast<float>(i % 4), y = static_cast<float>(i / 4);
    even.colors[i] = {0.3f, 0.2f, 0.1f};
    slope.colors[i] = (1.0f + 0.05f * x + 0.02f * y) * Vec3(1.0f, 0.9f, 0.8f);
    edge.colors[i] = x < 2 ? Vec3(3.0f, 2.9f, 2.5f) * (1.0f + 0.01f * y) : Vec3(0.2f, 0.25f, 0.3f) * (1.0f + 0.02f * x);
    dark.colors[i] = 1e-4f * slope.colors[i];
    tint.colors[i] = {1.0f + 0.1f * x, 1.3f - 0.1f * x, 1.0f + 0.1f * y};
    for (bc6h::Texels* block : {&even, &slope, &edge, &dark, &tint}) block->weights[i] = 1.0f;
  }
  EXPECT_LT(relativeError(even, false), 2e-4);    // a mode of 16 bits, and halves themselves
  EXPECT_LT(relativeError(slope, false), 6e-3);   // 16 steps of 1.5%, uniformly: 1.5% / sqrt(12)
  EXPECT_LT(relativeError(edge, false), 1.5e-2);  // two regions at 7 to 10 bits
  EXPECT_LT(relativeError(dark, false), 6e-3);    // as the slope
  EXPECT_LT(relativeError(tint, false), 5e-2);    // colours that lie on no line
  for (Vec3& color : slope.colors) color = Vec3(color.x, -color.y, color.z - 1.0f);
  EXPECT_LT(relativeError(slope, true), 1.5e-2);
}

TEST(Bc6h, TexelsThatDoNotCountDoNotDisturb) {
  bc6h::Texels block;
  for (std::size_t i = 0; i < bc6h::kTexels; ++i) {
    block.colors[i] = i < 12 ? Vec3(1.0f + 0.01f * static_cast<float>(i)) : Vec3(0.0f);
    block.weights[i] = i < 12 ? 1.0f : 0.0f;
  }
  EXPECT_LT(relativeError(block, false), 3e-3);  // 16 steps over 11%
  block.colors.fill(Vec3(0.0f));
  block.weights.fill(1.0f);
  for (const Vec3& color : bc6h::decode(bc6h::encode(block, false), false)) EXPECT_EQ(color, Vec3(0.0f));
}

TEST(TexelFormats, ValuesThatDoNotFitAreNamed) {
  Image image(4, 4, 3, 1.0f);
  for (const TexelFormat format : {TexelFormat::Half, TexelFormat::Rgb9e5, TexelFormat::Bc6h, TexelFormat::Bc6hSigned})
    EXPECT_FALSE(whyUnfit(format, image));
  image.pixels[5] = -0.5f;
  EXPECT_TRUE(mentions(whyUnfit(TexelFormat::Bc6h, image).value_or(""), "a negative value, -0.5"));
  EXPECT_FALSE(whyUnfit(TexelFormat::Bc6hSigned, image));
  image.pixels[5] = -1e-6f;
  EXPECT_FALSE(whyUnfit(TexelFormat::Rgb9e5, image));
  image.pixels[5] = 65450.0f;
  EXPECT_TRUE(mentions(whyUnfit(TexelFormat::Rgb9e5, image).value_or(""), "beyond 65408"));
  EXPECT_FALSE(whyUnfit(TexelFormat::Half, image));
  image.pixels[5] = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(whyUnfit(TexelFormat::Half, image));
}

TEST(TexelFormats, ImagesOfAnySizeComeBack) {
  for (const TexelFormat format : {TexelFormat::Half, TexelFormat::Rgb9e5, TexelFormat::Bc6h, TexelFormat::Bc6hSigned})
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 3), std::pair(8, 8)}) {
      Image image(width, height, 3);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image.setRgb(x, y, Vec3(1.0f + 0.1f * static_cast<float>(x + y)));
      const auto bytes = encodeTexels(format, image);
      ASSERT_EQ(bytes.size(), byteCount(format, width, height));
      const Image seen = decodeTexels(format, bytes, width, height);
      // The steepest block goes from 1.8 to 2.4 along its diagonal: half of a step of its 8 or 16, doubled.
      for (std::size_t i = 0; i < image.pixels.size(); ++i)
        EXPECT_NEAR(seen.pixels[i], image.pixels[i], 0.03f * image.pixels[i]) << traitsOf(format).name;
    }
}

/// Two charts side by side on a page of 8 x 4: columns 0 to 2 hold 1, columns 3 to 5 hold 100, the rest nothing.
ChartTexels twoCharts() {
  ChartTexels page{8, 4, {}, {}, {}};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) {
      page.charts.push_back(x < 3 ? 1 : x < 6 ? 2 : 0);
      page.weights.push_back(x < 6 ? 1.0f : 0.0f);
      page.kept.push_back(x < 6);
    }
  return page;
}

TEST(ChartMips, NoTexelMixesCharts) {
  const ChartTexels page = twoCharts();
  Image map(8, 4, 3);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) map.setRgb(x, y, Vec3(x < 3 ? 1.0f : 100.0f));
  const auto levels = mipTexels(page);
  ASSERT_EQ(levels.size(), 4u);        // 8 x 4, 4 x 2, 2 x 1, 1 x 1
  EXPECT_EQ(levels[1].charts[1], 1u);  // as much of either: the first
  EXPECT_FLOAT_EQ(levels[1].weights[1], 0.5f);
  const auto images = mipImages(map, levels);
  for (const Image& image : images)
    for (const float v : image.pixels) EXPECT_TRUE(v == 1.0f || v == 100.0f || (v > 1.0f && &image == &images[0])) << v;
  EXPECT_EQ(images[1].rgb(0, 0).x, 1.0f);
  EXPECT_EQ(images[1].rgb(2, 0).x, 100.0f);
  EXPECT_EQ(images[1].rgb(3, 0).x, 100.0f);  // filled from beside it
  EXPECT_EQ(images[0].rgb(7, 0).x, 100.0f);  // two texels off any chart: from the coarser level
  for (int x = 0; x < 6; ++x) EXPECT_EQ(images[0].rgb(x, 1), map.rgb(x, 1));
}

TEST(ChartMips, TexelsCountByTheirCoverage) {
  ChartTexels page{2, 2, {1, 1, 1, 1}, {1.0f, 0.5f, 0.25f, 0.25f}, {1, 1, 1, 1}};
  Image map(2, 2, 3);
  for (int i = 0; i < 4; ++i) map.setRgb(i % 2, i / 2, Vec3(static_cast<float>(i)));
  const auto images = mipImages(map, mipTexels(page));
  EXPECT_FLOAT_EQ(images[1].pixels[0], (0.0f + 0.5f + 0.5f + 0.75f) / 2.0f);
  // Odd sizes: nothing is lost at the rim.
  ChartTexels odd{3, 1, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  Image row(3, 1, 3);
  row.setRgb(2, 0, Vec3(3.0f));
  EXPECT_FLOAT_EQ(mipImages(row, mipTexels(odd))[1].pixels[0], 1.0f);
}

std::uint32_t wordAt(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return bytes[at] | static_cast<std::uint32_t>(bytes[at + 1]) << 8 | static_cast<std::uint32_t>(bytes[at + 2]) << 16 |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

TEST(TextureFiles, Ktx2SaysWhereItsLevelsAre) {
  for (const TexelFormat format : {TexelFormat::Half, TexelFormat::Rgb9e5, TexelFormat::Bc6h}) {
    GpuTexture texture{format, 8, 4, 1, {}, {{"lumel:map", "flat"}}};
    for (const auto& [width, height] : {std::pair(8, 4), std::pair(4, 2), std::pair(2, 1), std::pair(1, 1)})
      texture.levels.emplace_back(byteCount(format, width, height), static_cast<std::uint8_t>(width));
    const auto file = ktx2File(texture);
    EXPECT_EQ(wordAt(file, 12), static_cast<std::uint32_t>(traitsOf(format).vkFormat));
    EXPECT_EQ(wordAt(file, 20), 8u);
    EXPECT_EQ(wordAt(file, 28), 0u);  // no depth: a 2D texture
    EXPECT_EQ(wordAt(file, 40), 4u);
    const std::uint32_t descriptor = wordAt(file, 48), descriptorSize = wordAt(file, 52);
    EXPECT_EQ(wordAt(file, descriptor), descriptorSize);
    EXPECT_EQ(wordAt(file, 56), descriptor + descriptorSize);  // keys follow
    for (std::size_t level = 0; level < 4; ++level) {
      const std::uint32_t offset = wordAt(file, 80 + 24 * level), size = wordAt(file, 88 + 24 * level);
      ASSERT_EQ(size, texture.levels[level].size());
      ASSERT_LE(offset + size, file.size());
      EXPECT_EQ(offset % std::max<std::size_t>(traitsOf(format).blockBytes, 4), 0u);
      EXPECT_TRUE(std::all_of(file.begin() + offset, file.begin() + offset + size,
                              [&](std::uint8_t byte) { return byte == texture.levels[level][0]; }));
      if (level > 0) {
        EXPECT_LT(offset, wordAt(file, 80 + 24 * (level - 1)));  // the coarsest comes first
      }
    }
  }
}

}  // namespace
}  // namespace lumel
