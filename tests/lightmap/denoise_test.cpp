#include "lightmap/maps/denoise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr int kSide = 64;
constexpr CoarseNormal kUp = {0, 0, 127};

/// A page of one even chart under the light `truth(x, y)`, with independent noise of standard deviation `sigma` in the
/// flat map and `rnmNoise` times as much in the others.
struct Page {
  Image flat{kSide, kSide, 3};
  std::array<Image, 3> rnm{Image(kSide, kSide, 3), Image(kSide, kSide, 3), Image(kSide, kSide, 3)};
  std::vector<std::uint32_t> charts = std::vector<std::uint32_t>(kSide * kSide, 1);
  std::vector<CoarseNormal> normals = std::vector<CoarseNormal>(kSide * kSide, kUp);
  std::vector<float> errors;
  std::array<std::vector<float>, 3> rnmErrors;

  template <class Truth>
  Page(const Truth& truth, float sigma, float rnmNoise = 1.4f) : errors(kSide * kSide, sigma) {
    rnmErrors.fill(std::vector<float>(kSide * kSide, rnmNoise * sigma));
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0.0f, 1.0f);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        flat.setRgb(x, y, Vec3(truth(x, y) + sigma * noise(random)));
        for (Image& map : rnm) map.setRgb(x, y, Vec3(truth(x, y) + rnmNoise * sigma * noise(random)));
      }
  }
  void denoise() {
    const std::array<ErrorPlane, 4> planes = {
        {{errors.data()}, {rnmErrors[0].data()}, {rnmErrors[1].data()}, {rnmErrors[2].data()}}};
    lumel::denoise(flat, rnm, charts, normals, planes);
  }
};

template <class Truth>
double rmsError(const Image& map, const Truth& truth) {
  double squares = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double d = static_cast<double>(map.rgb(x, y).x) - static_cast<double>(truth(x, y));
      squares += d * d;
    }
  return std::sqrt(squares / (kSide * kSide));
}

TEST(Denoise, SmoothLightKeepsATenthOfItsNoiseAndItsMean) {
  const auto truth = [](int x, int y) {
    return 1.0f + 0.002f * static_cast<float>(x) + 0.001f * static_cast<float>(y);
  };
  Page page(truth, 0.1f);
  page.denoise();
  // The mean of 121 alike texels would keep 1/11 = 0.009; the weights are not all alike, and noise of the weights
  // themselves is left. Twice that is allowed.
  EXPECT_LT(rmsError(page.flat, truth), 0.018);
  EXPECT_LT(rmsError(page.rnm[1], truth), 0.025);
  double mean = 0;
  for (const float v : page.flat.pixels) mean += static_cast<double>(v);
  EXPECT_NEAR(mean / static_cast<double>(page.flat.pixels.size()), 1.0945, 0.0045);  // 3 x 0.1 / 64, as it came in
}

TEST(Denoise, ASlopeIsNotBentAtTheBordersOfAChart) {
  const auto truth = [](int x, int) { return 1.0f + 0.01f * static_cast<float>(x); };
  Page page(truth, 0.1f);
  page.denoise();
  double first = 0;
  for (int y = 0; y < kSide; ++y) first += static_cast<double>(page.flat.rgb(0, y).x) / kSide;
  // Means of texels to the right alone would lift the border by about 2.5 steps, 0.025. Noise: 0.1 / sqrt(64) = 0.0125,
  // which the input's mean of this column has too.
  double noisy = 0;
  const Page input(truth, 0.1f);
  for (int y = 0; y < kSide; ++y) noisy += static_cast<double>(input.flat.rgb(0, y).x) / kSide;
  // Those that have no opposite count a little and lift it by half a step.
  EXPECT_NEAR(first, noisy, 0.0065);
}

TEST(Denoise, ChartsKeepTheirLightWhereItCurves) {
  const auto pools = [](int x, int y) {
    const auto near = [&](float cx, float cy) {
      const float dx = static_cast<float>(x) - cx, dy = static_cast<float>(y) - cy;
      return 1.0f / (1.0f + 0.01f * (dx * dx + dy * dy));
    };
    return 0.1f + near(12.0f, 20.0f) + near(50.0f, 40.0f);
  };
  Page page(pools, 0.05f);
  for (std::size_t i = 0; i < page.charts.size(); ++i) page.charts[i] = i % kSide < kSide / 2 ? 1 : 2;
  const auto lightOf = [&](std::uint32_t chart) {
    double sum = 0;
    for (std::size_t i = 0; i < page.charts.size(); ++i)
      if (page.charts[i] == chart) sum += static_cast<double>(page.flat.pixels[3 * i]);
    return sum;
  };
  const double left = lightOf(1), right = lightOf(2);
  page.denoise();
  // Averaging alone takes 1.1% here; floats round to 6e-8.
  EXPECT_NEAR(lightOf(1) / left, 1.0, 2e-6);
  EXPECT_NEAR(lightOf(2) / right, 1.0, 2e-6);
  EXPECT_LT(rmsError(page.flat, pools), 0.02);
}

// Light that grazes a surface is in one tilted map and hardly in the flat one.
TEST(Denoise, WhatIsGivenBackIsAShareOfWhatATexelHolds) {
  const auto pool = [](int x, int y) {
    const float dx = static_cast<float>(x) - 32.0f, dy = static_cast<float>(y) - 32.0f;
    return 1.0f / (1.0f + 0.01f * (dx * dx + dy * dy));
  };
  Page page(pool, 0.05f);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      page.flat.setRgb(x, y, Vec3(1e-4f));
      page.rnm[0].setRgb(x, y, Vec3(1.0f));
    }
  page.denoise();
  for (int y = 2; y < 12; ++y)
    for (int x = 2; x < 12; ++x) {
      EXPECT_NEAR(page.rnm[0].rgb(x, y).x, 1.0f, 0.05f);
      EXPECT_GE(page.flat.rgb(x, y).x, 0.0f);
    }
}

TEST(Denoise, AShadowsEdgeStaysWhereItIs) {
  const auto truth = [](int x, int) { return x < kSide / 2 ? 1.0f : 0.2f; };
  Page page(truth, 0.05f);
  page.denoise();
  EXPECT_LT(rmsError(page.flat, truth), 0.02);
  for (int y = 0; y < kSide; ++y) {
    EXPECT_GT(page.flat.rgb(kSide / 2 - 1, y).x, 0.85f);
    EXPECT_LT(page.flat.rgb(kSide / 2, y).x, 0.35f);
  }
}

// Light that comes in at a low angle is in the tilted maps, and so is its noise.
TEST(Denoise, RnmMapsAreJudgedByTheirOwnNoise) {
  const auto truth = [](int, int) { return 1.0f; };
  Page page(truth, 0.05f, 2.6f);
  page.denoise();
  // By twice the flat map's variance patches would be (1 + 3 * 6.8 / 2) / 4 - 1 = 1.8 apart on average, and their
  // weights half as large: that leaves 0.023 and 0.0080. Own noise is 0.13, means of 81 texels have 0.014 and 0.0056.
  EXPECT_LT(rmsError(page.rnm[0], truth), 0.02);
  EXPECT_LT(rmsError(page.flat, truth), 0.0075);
}

TEST(Denoise, TexelsThatFaceElsewhereAreStrangers) {
  const auto truth = [](int x, int) { return x / 4 % 2 == 0 ? 1.0f : 1.1f; };
  Page folded(truth, 0.1f);
  for (std::size_t i = 0; i < folded.normals.size(); ++i)
    if (i % kSide / 4 % 2 != 0) folded.normals[i] = {90, 0, 90};  // 45 degrees
  Page flat(truth, 0.1f);
  folded.denoise();
  flat.denoise();
  // The step is that of the noise: only normals tell of it. Without them half of it is lost, 0.05. A stripe has about
  // 4 x 9 texels in the window, whose mean has 0.1 / 6 = 0.017; weights have noise, too.
  EXPECT_LT(rmsError(folded.flat, truth), 0.026);
  EXPECT_GT(rmsError(flat.flat, truth), 0.03);
}

// Errors are stated for regions: those of a bright line reach into the dark beside it.
TEST(Denoise, DarkTexelsTakeNothingFromBrightOnes) {
  const auto truth = [](int x, int) { return x / 2 == 16 ? 1.0f : 0.01f; };
  Page page(truth, 0.0f);
  for (float& e : page.errors) e = 0.3f;
  page.denoise();
  // The line's own texels have that error, so the texels that touch it may be of it.
  for (int x = 0; x < kSide; ++x)
    if (x < 31 || x > 34) {
      EXPECT_LT(page.flat.rgb(x, 30).x, 0.02f) << x;
    }
}

TEST(Denoise, WithoutNoiseNothingChanges) {
  const auto truth = [](int x, int y) { return 1.0f + 0.5f * std::sin(0.3f * static_cast<float>(x * 3 + y)); };
  Page page(truth, 0.0f);
  const Image before = page.flat;
  page.denoise();
  for (std::size_t i = 0; i < before.pixels.size(); ++i)
    EXPECT_NEAR(page.flat.pixels[i], before.pixels[i], 1e-4f);  // equal neighbours are averaged: rounding alone
}

TEST(Denoise, ChartsAreStrangersAndUncoveredTexelsStay) {
  const auto truth = [](int, int) { return 1.0f; };
  Page page(truth, 0.1f);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const auto i = static_cast<std::size_t>(y * kSide + x);
      page.charts[i] = x < 20 ? 1u : x < 24 ? 0u : 2u;
      if (x >= 24) page.flat.setRgb(x, y, page.flat.rgb(x, y) + Vec3(0.05f));  // well within the noise
      if (page.charts[i] == 0) page.flat.setRgb(x, y, Vec3(77.0f));
    }
  page.denoise();
  double left = 0, right = 0;
  for (int y = 0; y < kSide; ++y) {
    left += static_cast<double>(page.flat.rgb(19, y).x) / kSide;
    right += static_cast<double>(page.flat.rgb(24, y).x) / kSide;
    EXPECT_EQ(page.flat.rgb(22, y).x, 77.0f);
  }
  EXPECT_NEAR(left, 1.0, 0.02);  // 0.1 / sqrt(64 rows of about 6 x 11 / 64 independent ones each): about 0.005
  EXPECT_NEAR(right, 1.05, 0.02);
}

TEST(Denoise, TheMapsMeanStaysTheFlatMap) {
  const auto truth = [](int x, int y) { return x > y ? 2.0f : 1.0f; };
  Page page(truth, 0.2f);
  for (std::size_t i = 0; i < page.flat.pixels.size(); ++i)
    page.flat.pixels[i] = (page.rnm[0].pixels[i] + page.rnm[1].pixels[i] + page.rnm[2].pixels[i]) / 3.0f;
  page.denoise();
  for (std::size_t i = 0; i < page.flat.pixels.size(); ++i)
    EXPECT_NEAR(page.flat.pixels[i], (page.rnm[0].pixels[i] + page.rnm[1].pixels[i] + page.rnm[2].pixels[i]) / 3.0f,
                1e-5f);
}

TEST(Denoise, ScaleDoesNotMatter) {
  const auto truth = [](int x, int) { return x < 30 ? 1.0f : 1.3f; };
  Page one(truth, 0.1f);
  one.denoise();
  for (const float scale : {1e-12f, 1e12f}) {
    Page page(truth, 0.1f);
    for (float& v : page.flat.pixels) v *= scale;
    for (Image& map : page.rnm)
      for (float& v : map.pixels) v *= scale;
    for (float& e : page.errors) e *= scale;
    page.denoise();
    for (std::size_t i = 0; i < page.flat.pixels.size(); i += 37)
      EXPECT_NEAR(page.flat.pixels[i] / scale, one.flat.pixels[i], 1e-4f);
  }
}

TEST(Denoise, WhatIsNotANumberSpreadsNoFurther) {
  const auto truth = [](int, int) { return 1.0f; };
  Page page(truth, 0.1f);
  page.flat.setRgb(30, 30, Vec3(std::numeric_limits<float>::quiet_NaN()));
  page.rnm[2].setRgb(10, 12, Vec3(std::numeric_limits<float>::infinity()));
  page.denoise();
  std::size_t bad = 0;
  for (const Image* map : {&page.flat, &page.rnm[0], &page.rnm[1], &page.rnm[2]})
    for (const float v : map->pixels)
      if (!std::isfinite(v)) ++bad;
  EXPECT_EQ(bad, 6u);
}

TEST(Denoise, SameBytesForAnyThreadCount) {
  const auto truth = [](int x, int y) { return static_cast<float>((x / 7 + y / 5) % 3); };
  Page one(truth, 0.3f);
  Page four(truth, 0.3f);
  {
    const ThreadLimit limit(1);
    one.denoise();
  }
  const ThreadLimit limit(4);
  four.denoise();
  EXPECT_EQ(one.flat.pixels, four.flat.pixels);
  EXPECT_EQ(one.rnm[2].pixels, four.rnm[2].pixels);
}

/// Share of texels whose truth lies within 1.96 of the errors that are stated of the result.
template <class Truth>
double coverage(const Image& map, const std::vector<float>& errors, const Truth& truth) {
  int within = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      within += std::abs(map.rgb(x, y).x - truth(x, y)) <= 1.96f * errors[static_cast<std::size_t>(y * kSide + x)];
  return static_cast<double>(within) / (kSide * kSide);
}

// On a page of about 60 independent means of 80 texels, so single pages scatter by some per cent.
TEST(Denoise, StatesTheErrorsOfItsResult) {
  const auto slope = [](int x, int y) {
    return 1.0f + 0.004f * static_cast<float>(x) + 0.002f * static_cast<float>(y);
  };
  Page page(slope, 0.1f);
  page.denoise();
  EXPECT_NEAR(coverage(page.flat, page.errors, slope), 0.95, 0.04);
  EXPECT_NEAR(coverage(page.rnm[0], page.rnmErrors[0], slope), 0.95, 0.04);
  double flat = 0, rnm = 0;
  for (std::size_t i = 0; i < page.errors.size(); ++i) {
    flat += static_cast<double>(page.errors[i] * page.errors[i]) / (kSide * kSide);
    rnm += static_cast<double>(page.rnmErrors[0][i] * page.rnmErrors[0][i]) / (kSide * kSide);
  }
  // Within a third of what is measured, which is a fifth of what came in.
  EXPECT_NEAR(std::sqrt(flat) / rmsError(page.flat, slope), 1.0, 0.33);
  EXPECT_NEAR(std::sqrt(rnm) / rmsError(page.rnm[0], slope), 1.0, 0.33);
}

// A texel may state next to nothing of the flat map, where its own samples met one light alone, and more of another.
TEST(Denoise, NoisierTexelsBesideAddNoErrorToOtherMaps) {
  Page page([](int, int) { return 1.0f; }, 0.1f);
  const float most = *std::max_element(page.rnmErrors[0].begin(), page.rnmErrors[0].end());
  for (std::size_t i = 0; i < page.errors.size(); i += 2) page.errors[i] = 1e-15f;
  page.denoise();
  // What averaging may have bent comes on top: a share of 0.05 of how far the texels differ, 0.1.
  EXPECT_LE(*std::max_element(page.rnmErrors[0].begin(), page.rnmErrors[0].end()), 2.0f * most);
}

TEST(Denoise, WhatIsNotKnownStaysSo) {
  const auto truth = [](int, int) { return 1.0f; };
  Page page(truth, 0.1f);
  page.errors[100] = page.rnmErrors[1][200] = std::numeric_limits<float>::quiet_NaN();
  page.denoise();
  for (std::size_t i = 0; i < page.errors.size(); ++i) {
    EXPECT_EQ(std::isfinite(page.errors[i]), i != 100) << i;
    EXPECT_EQ(std::isfinite(page.rnmErrors[1][i]), i != 200) << i;
    EXPECT_TRUE(std::isfinite(page.flat.pixels[3 * i])) << i;
  }
}

/// Pages are worked on in tiles, rows above a strip of them have changed already: neither may be seen.
TEST(Denoise, PlaceOnThePageDoesNotMatter) {
  constexpr int kWidth = 290;
  constexpr int kHeight = 300;
  const auto denoisedAt = [](int left, int top) {
    const int width = kWidth + 300;
    const int height = kHeight + 150;
    Image flat(width, height, 3);
    std::array<Image, 3> rnm = {flat, flat, flat};
    std::vector<std::uint32_t> charts(flat.pixels.size() / 3, 0);
    std::vector<float> errors(charts.size() * 2, 0.2f);
    std::vector<float> others = errors;
    std::mt19937 random(7);
    std::normal_distribution<float> noise(1.0f, 0.2f);
    for (int y = top; y < top + kHeight; ++y)
      for (int x = left; x < left + kWidth; ++x) {
        charts[static_cast<std::size_t>(y * width + x)] = 1;
        for (Image* map : {&flat, &rnm[0], &rnm[1], &rnm[2]}) map->setRgb(x, y, Vec3(noise(random)));
      }
    const ErrorPlane other{others.data(), 2};
    denoise(flat, rnm, charts, std::vector<CoarseNormal>(charts.size(), kUp),
            std::array<ErrorPlane, 4>{{{errors.data(), 2}, other, other, other}});
    std::vector<float> values;
    for (int y = top; y < top + kHeight; ++y)
      for (int x = left; x < left + kWidth; ++x)
        values.push_back(flat.rgb(x, y).x + rnm[2].rgb(x, y).x + errors[static_cast<std::size_t>(2 * (y * width + x))]);
    return values;
  };
  const std::vector<float> values = denoisedAt(0, 0);
  EXPECT_EQ(values, denoisedAt(37, 101));
  EXPECT_EQ(values, denoisedAt(300, 1));
}

TEST(Denoise, PagesSmallerThanThePatch) {
  for (const int side : {0, 1, 2}) {
    Image flat(side, side, 3, 0.5f);
    std::array<Image, 3> rnm = {flat, flat, flat};
    const std::vector<std::uint32_t> charts(flat.pixels.size() / 3, 1);
    std::array<std::vector<float>, 4> errors;
    errors.fill(std::vector<float>(charts.size(), 0.1f));
    denoise(
        flat, rnm, charts, std::vector<CoarseNormal>(charts.size(), kUp),
        std::array<ErrorPlane, 4>{{{errors[0].data()}, {errors[1].data()}, {errors[2].data()}, {errors[3].data()}}});
    for (const float v : flat.pixels) EXPECT_FLOAT_EQ(v, 0.5f);
  }
}

}  // namespace
}  // namespace lumel
