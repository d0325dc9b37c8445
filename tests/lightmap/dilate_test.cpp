#include "lightmap/maps/dilate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

TexelMask maskOf(int width, int height, std::uint8_t value = 0) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), value)};
}

std::size_t at(int x, int y, int width) { return static_cast<std::size_t>(y * width + x); }

TEST(Dilate, OneTexelGrowsByRings) {
  for (const int rings : {0, 1, 2, 3, 100}) {
    Image image(9, 7, 3);
    TexelMask mask = maskOf(9, 7);
    image.setRgb(4, 3, Vec3(1, 2, 3));
    mask.known[at(4, 3, 9)] = 1;
    dilate(image, mask, rings);
    for (int y = 0; y < 7; ++y)
      for (int x = 0; x < 9; ++x) {
        const bool reached = std::max(std::abs(x - 4), std::abs(y - 3)) <= rings;
        EXPECT_EQ(mask.known[at(x, y, 9)], reached ? 1 : 0);
        EXPECT_EQ(image.rgb(x, y), reached ? Vec3(1, 2, 3) : Vec3(0));
      }
  }
}

TEST(Dilate, TakesTheMeanOfKnownNeighboursOfTheRingBefore) {
  // 5 and 1 at the ends of a row: the middle is their mean only after both sides have arrived.
  Image image(5, 1, 1);
  TexelMask mask = maskOf(5, 1);
  image.at(0, 0)[0] = 5;
  image.at(4, 0)[0] = 1;
  mask.known[0] = mask.known[4] = 1;
  dilate(image, mask, 1);
  EXPECT_EQ(image.pixels, (std::vector<float>{5, 5, 0, 1, 1}));
  dilate(image, mask, 1);
  EXPECT_EQ(image.pixels, (std::vector<float>{5, 5, 3, 1, 1}));
}

TEST(Dilate, KnownTexelsStayAndBlackIsAColour) {
  Image image(3, 1, 1);
  TexelMask mask = maskOf(3, 1);
  image.pixels = {0, 9, 4};  // the 9 is not known: never read
  mask.known = {1, 0, 1};
  dilate(image, mask, 4);
  EXPECT_EQ(image.pixels, (std::vector<float>{0, 2, 4}));
}

TEST(Dilate, NothingKnownOrNoImage) {
  Image image(4, 4, 3, 0.5f);
  TexelMask mask = maskOf(4, 4);
  dilate(image, mask, 3);
  EXPECT_EQ(image.pixels, Image(4, 4, 3, 0.5f).pixels);
  EXPECT_EQ(mask.known, maskOf(4, 4).known);
  Image none;
  TexelMask empty;
  dilate(none, empty, 3);
  EXPECT_TRUE(none.empty());
}

TEST(Dilate, SameForAnyThreadCount) {
  Image images[2];
  for (const int threads : {1, 2}) {
    ThreadLimit limit(threads);
    Image image(200, 150, 3);
    TexelMask mask = maskOf(200, 150);
    for (int i = 0; i < 60; ++i) {
      image.setRgb(i * 37 % 200, i * 53 % 150, Vec3(static_cast<float>(i), 1, 0.1f));
      mask.known[at(i * 37 % 200, i * 53 % 150, 200)] = 1;
    }
    dilate(image, mask, 20);
    images[threads - 1] = image;
  }
  EXPECT_EQ(images[0].pixels, images[1].pixels);
}

struct HoleCase {
  Image image{8, 8, 1};
  TexelMask valid = maskOf(8, 8, 1);
  std::vector<std::uint32_t> charts = std::vector<std::uint32_t>(64, 1);
  std::vector<std::uint8_t> holes = std::vector<std::uint8_t>(64, 0);

  void makeHole(int x, int y) {
    holes[at(x, y, 8)] = 1;
    valid.known[at(x, y, 8)] = 0;
    image.at(x, y)[0] = 1000;  // must not be seen
  }
};

TEST(FillHoles, ConstantSurroundingsGiveThatConstant) {
  HoleCase c;
  std::fill(c.image.pixels.begin(), c.image.pixels.end(), 7.0f);
  for (int y = 2; y < 6; ++y)
    for (int x = 2; x < 6; ++x) c.makeHole(x, y);
  fillHoles(c.image, c.valid, c.charts, c.holes);
  for (const float value : c.image.pixels) EXPECT_EQ(value, 7.0f);
}

TEST(FillHoles, TakesTheLightOfTheSideThatItLiesOn) {
  HoleCase c;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) *c.image.at(x, y) = static_cast<float>(x);
  for (int y = 0; y < 8; ++y)
    for (int x = 2; x < 6; ++x) c.makeHole(x, y);
  fillHoles(c.image, c.valid, c.charts, c.holes);
  for (int y = 0; y < 8; ++y)
    for (int x = 2; x < 6; ++x) EXPECT_EQ(*c.image.at(x, y), x < 4 ? 1.0f : 6.0f) << x << ", " << y;
}

TEST(FillHoles, ReadsTheOwnChartOnly) {
  HoleCase c;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      c.charts[at(x, y, 8)] = x < 4 ? 1 : 2;
      *c.image.at(x, y) = x < 4 ? 1.0f : 50.0f;
    }
  for (int y = 0; y < 8; ++y) c.makeHole(3, y);
  fillHoles(c.image, c.valid, c.charts, c.holes);
  for (int y = 0; y < 8; ++y) EXPECT_EQ(*c.image.at(3, y), 1.0f);
}

TEST(FillHoles, ChartWithoutAnyValueKeepsWhatItHas) {
  HoleCase c;
  for (int y = 0; y < 8; ++y)
    for (int x = 5; x < 8; ++x) {
      c.makeHole(x, y);
      c.charts[at(x, y, 8)] = 9;
      *c.image.at(x, y) = 0.25f;
    }
  fillHoles(c.image, c.valid, c.charts, c.holes);
  for (int y = 0; y < 8; ++y) EXPECT_EQ(*c.image.at(6, y), 0.25f);
}

TEST(FillHoles, InvalidTexelsThatAreNoHolesAreNeitherReadNorWritten) {
  HoleCase c;
  std::fill(c.image.pixels.begin(), c.image.pixels.end(), 2.0f);
  c.makeHole(3, 3);
  c.valid.known[at(4, 3, 8)] = 0;  // uncovered
  *c.image.at(4, 3) = std::numeric_limits<float>::quiet_NaN();
  fillHoles(c.image, c.valid, c.charts, c.holes);
  EXPECT_EQ(*c.image.at(3, 3), 2.0f);
  EXPECT_TRUE(std::isnan(*c.image.at(4, 3)));
}

}  // namespace
}  // namespace lumel
