// Figures of images, exposure and tone curve.
#include <gtest/gtest.h>

#include <limits>

#include "baker/commands/image_figures.h"
#include "baker/stills/tone_map.h"

namespace lumel {
namespace {

const PixelMask kAll = [](int, int) { return true; };

TEST(ImageFigures, CountsWhatIsNotFiniteApart) {
  Image image(2, 2, 1);
  image.pixels = {1.0f, std::numeric_limits<float>::quiet_NaN(), 3.0f, std::numeric_limits<float>::infinity()};
  const auto figures = channelFigures(image);
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0].least, 1.0f);
  EXPECT_EQ(figures[0].most, 3.0f);
  EXPECT_EQ(figures[0].mean, 2.0);
  EXPECT_EQ(figures[0].notANumber, 1u);
  EXPECT_EQ(figures[0].infinite, 1u);
}

TEST(ImageFigures, DifferenceByHand) {
  Image a(2, 1, 2);
  Image b(2, 1, 2);
  a.pixels = {1, 5, 3, 5};
  b.pixels = {1, 4, 1, 2};
  const auto d = compareImages(a, b, kAll);
  EXPECT_DOUBLE_EQ(d.channels[0].rmse, std::sqrt(2.0));              // differences 0 and 2
  EXPECT_DOUBLE_EQ(d.channels[0].relativeRmse, std::sqrt(4.0 / 2));  // over 1, 1
  EXPECT_DOUBLE_EQ(d.channels[1].maximum, 3.0);
  EXPECT_DOUBLE_EQ(d.channels[1].meanRatio(), 10.0 / 6.0);
  const auto masked = compareImages(a, b, [](int x, int) { return x == 0; });
  EXPECT_DOUBLE_EQ(masked.all.rmse, std::sqrt(0.5));  // differences 0 and 1
  EXPECT_EQ(compareImages(a, b, [](int, int) { return false; }).all.count, 0u);
}

TEST(ToneMap, ExposureBringsAnEvenPictureToMiddleGrey) {
  const Image surface(4, 4, 1, 1.0f);
  for (float level : {1e-3f, 1.0f, 1e4f})
    EXPECT_NEAR(level * std::exp2(autoExposure(Image(4, 4, 3, level), surface)), 0.16f, 1e-4f);
  EXPECT_EQ(autoExposure(Image(4, 4, 3, 0.0f), surface), 0.0f);
  // A bright sky does not count.
  Image half(4, 4, 3, 1.0f);
  Image left(4, 4, 1, 1.0f);
  for (int y = 0; y < 4; ++y)
    for (int x = 2; x < 4; ++x) {
      half.setRgb(x, y, Vec3(1000.0f));
      left.at(x, y)[0] = 0.0f;
    }
  EXPECT_NEAR(std::exp2(autoExposure(half, left)), 0.16f, 1e-4f);
}

TEST(ToneMap, CurvesRiseFromBlackToAtMostOne) {
  Image ramp(64, 1, 1);
  for (int x = 0; x < 64; ++x) ramp.at(x, 0)[0] = std::exp2(static_cast<float>(x) / 4.0f - 12.0f);
  for (ToneMap curve : {ToneMap::Aces, ToneMap::Linear}) {
    const Image shown = toneMap(ramp, 0.0f, curve);
    for (int x = 1; x < 64; ++x) EXPECT_GE(shown.at(x, 0)[0], shown.at(x - 1, 0)[0]);
    EXPECT_LE(shown.at(63, 0)[0], 1.0f);
    EXPECT_EQ(toneMap(Image(1, 1, 1, 0.0f), 0.0f, curve).at(0, 0)[0], 0.0f);
  }
  // Linear 0.5 is sRGB 0.735; one stop more is white.
  EXPECT_NEAR(toneMap(Image(1, 1, 1, 0.5f), 0.0f, ToneMap::Linear).at(0, 0)[0], 0.7354f, 1e-3f);
  EXPECT_NEAR(toneMap(Image(1, 1, 1, 0.5f), 1.0f, ToneMap::Linear).at(0, 0)[0], 1.0f, 1e-6f);
}

}  // namespace
}  // namespace lumel
