// Horizons against closed forms, wrapping, edges, and the promise of the same bits.
#include "ssbump/occlusion/horizon.h"

#include <gtest/gtest.h>

#include <array>

#include "lightmap/maps/rnm_basis.h"
#include "scene/base/parallel.h"
#include "tests/ssbump/closed_forms.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

using namespace closed_forms;

std::vector<Lobe> allLobes() {
  std::vector<Lobe> lobes = rnmLobes();
  lobes.push_back(ambientLobe());
  return lobes;
}

std::vector<float> at(const HeightField& field, int x, int y, HorizonSettings settings = {.azimuths = 256}) {
  const Image o = Horizon(field, settings).occlusion({x, y, 1, 1}, allLobes());
  return o.pixels;
}

// With 256 azimuths the sum over slices errs by up to 2e-3 where a lobe's own horizon meets a wall's. Beyond 12 texels
// a straight edge is met on one kind of grid line only, which lowers it by up to half a percent at grazing azimuths:
// the most that is seen of both for an edge within 12 texels is 2.2e-3.
constexpr double kClosedFormTolerance = 0.0025;
constexpr double kFarTolerance = 0.006;

TEST(Horizon, FlatIsOpenExactly) {
  for (float level : {0.0f, -7.5f, 1e5f}) {
    const HeightField flat = fields::make(33, 17, true, [&](int, int) { return level; });
    const Image o = Horizon(flat, {}).occlusion({0, 0, 33, 17}, allLobes());
    for (float v : o.pixels) EXPECT_EQ(v, 1.0f);
  }
}

TEST(Horizon, OneTexelIsFlat) {
  const HeightField one = fields::make(1, 1, true, [](int, int) { return 5.0f; });
  for (float v : at(one, 0, 0)) EXPECT_EQ(v, 1.0f);
}

TEST(Horizon, WallTowardsEachSide) {
  struct Case {
    double phi;
    std::function<int(int, int)> distance;  // from the middle to the wall, in its direction
  };
  const std::array<Case, 4> cases{{{kEast, [](int x, int) { return x - 128; }},
                                   {kNorth, [](int, int y) { return 128 - y; }},
                                   {kWest, [](int x, int) { return 128 - x; }},
                                   {kSouth, [](int, int y) { return y - 128; }}}};
  for (const Case& c : cases)
    for (const auto& [distance, height] : {std::pair{1, 0.5f}, {3, 3.0f}, {6, 12.0f}, {20, 20.0f}}) {
      const HeightField wall = fields::make(
          257, 257, false, [&, d = distance, h = height](int x, int y) { return c.distance(x, y) >= d ? h : 0.0f; });
      const auto o = at(wall, 128, 128);
      const double slope = static_cast<double>(height) / distance;
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(o[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(c.phi, slope)}),
                    distance <= 12 ? kClosedFormTolerance : kFarTolerance)
            << "phi " << c.phi << " distance " << distance << " B" << i;
      EXPECT_NEAR(o[3], (1 + std::cos(std::atan(slope))) / 2, distance <= 12 ? kClosedFormTolerance : kFarTolerance);
    }
}

TEST(Horizon, InfiniteGroove) {
  for (const auto& [left, right, height] : {std::tuple{4, 4, 6.0f}, {2, 7, 5.0f}, {11, 3, 12.0f}}) {
    // Tiles along the groove; across it the walls are plateaus as wide as the map.
    const HeightField groove = fields::make(128, 64, true, [&, l = left, r = right, h = height](int x, int) {
      return x - 64 >= r || 64 - x >= l ? h : 0.0f;
    });
    const auto o = at(groove, 64, 32);
    const double e = static_cast<double>(height) / right, w = static_cast<double>(height) / left;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(o[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kEast, e), wallPlane(kWest, w)}),
                  kClosedFormTolerance);
    EXPECT_NEAR(o[3], (std::cos(std::atan(e)) + std::cos(std::atan(w))) / 2, kClosedFormTolerance);
    // On the plateau, far from the edge, nothing rises.
    for (float v : at(groove, 0, 10)) EXPECT_NEAR(v, 1.0f, 1e-6f);
  }
}

TEST(Horizon, StaircaseSeesOnlyTheNextRiser) {
  constexpr int kTread = 9;
  const HeightField stairs =
      fields::make(180, 301, false, [](int x, int) { return 5.0f * static_cast<float>(x / kTread); });
  for (int d = 1; d <= kTread; ++d) {
    const auto o = at(stairs, 10 * kTread - d, 150);  // the next riser's top edge is d texels to the east
    const double slope = 5.0 / d;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(o[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kEast, slope)}), kClosedFormTolerance) << d;
  }
}

TEST(Horizon, ConePitSeesACap) {
  // A flat bottom of radius 8, then a slope of 2 up to radius 60: the rim stands at slope 2 * 52 / 60 everywhere.
  const HeightField pit = fields::make(161, 161, false, [](int x, int y) {
    return 2.0f * std::clamp(std::hypot(static_cast<float>(x - 80), static_cast<float>(y - 80)) - 8.0f, 0.0f, 52.0f);
  });
  const double t = 2.0 * 52 / 60, q = 1 / (1 + t * t), c = 1 / std::sqrt(3.0);
  ASSERT_GT(t, std::sqrt(2.0));  // the cap lies wholly in front of each basis vector: its integral is pi q (n.B)
  const auto o = at(pit, 80, 80);
  // 0.5%: the rim is a polygon of texels, and far steps see its highest texel.
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(o[i], 2 * c * q / (1 + c), 0.005);
  EXPECT_NEAR(o[3], q, 0.005);
}

TEST(Horizon, HemispherePitSeesHalf) {
  constexpr float kRadius = 100;
  const HeightField pit = fields::make(257, 257, false, [=](int x, int y) {
    const float r = std::min(kRadius, std::hypot(static_cast<float>(x - 128), static_cast<float>(y - 128)));
    return kRadius - std::sqrt(kRadius * kRadius - r * r);
  });
  const auto o = at(pit, 128, 128);
  // A lone rim may lie anywhere within a step of 1/16 of its distance, so its slope is low by up to 1/32; halved by the
  // derivative of 1 / (1 + t^2) at 1.
  constexpr double kStepTolerance = 0.5 / 32;
  // From the lowest point the rim stands at 45 degrees. Lobes: midpoint rule over the cap, from the definition.
  std::array<double, 3> cap{};
  constexpr int kSteps = 1200;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double z = std::sqrt(0.5) + (i + 0.5) / kSteps * (1 - std::sqrt(0.5)),
                   phi = 2 * std::numbers::pi * j / kSteps, s = std::sqrt(1 - z * z);
      for (std::size_t k = 0; k < 3; ++k)
        cap[k] += std::max(0.0, glm::dot(Vec3d(kRnmBasis[k]), Vec3d(s * std::cos(phi), s * std::sin(phi), z)));
    }
  const double solidAngle = 2 * std::numbers::pi * (1 - std::sqrt(0.5)) / (kSteps * double{kSteps});
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(o[k], cap[k] * solidAngle / (std::numbers::pi * (1 + static_cast<double>(kRnmBasis[k].z)) / 2),
                kStepTolerance);
  EXPECT_NEAR(o[3], 0.5, kStepTolerance);
}

TEST(Horizon, LoneWallsAreNearTheirSlopeAtEveryDistance) {
  // One azimuth, straight up the image; AO of one slice is 1 / (1 + t^2). The wall may lie anywhere in a window of 1/16
  // of its distance that is taken to be 1/4 behind its centre: 3/4 of half a window low is 4.7%, and the cells, half a
  // thirty-second of the distance, shift it by as much as 1.6%.
  for (int distance = 33; distance < 1900; distance += distance < 130 ? 1 : 37) {
    const float wall = 0.5f * static_cast<float>(distance);
    const HeightField field =
        fields::make(64, 1960, false, [&](int, int y) { return 1950 - y >= distance ? wall : 0.0f; });
    const std::array<Lobe, 1> lobes{ambientLobe()};
    const Image o = Horizon(field, {.azimuths = 1, .reach = 2000}).occlusion({32, 1950, 1, 1}, lobes);
    const double slope = std::sqrt(1 / static_cast<double>(o.at(0, 0)[0]) - 1);
    EXPECT_GT(slope, 0.5 * (1 - 0.063)) << distance;
    EXPECT_LT(slope, 0.5 * (1 + 0.04)) << distance;
  }
}

TEST(Horizon, FarWallsStandOnNarrowMapsToo) {
  for (int width : {1, 3, 17, 40})
    for (int distance : {70, 150, 300, 522, 1000}) {
      const float wall = 0.5f * static_cast<float>(distance);
      const HeightField field =
          fields::make(width, 1100, false, [&](int, int y) { return 1050 - y >= distance ? wall : 0.0f; });
      const std::array<Lobe, 1> lobes{ambientLobe()};
      for (int x : {0, width / 2, width - 1}) {
        const Image o = Horizon(field, {.azimuths = 1, .reach = 1100}).occlusion({x, 1050, 1, 1}, lobes);
        EXPECT_NEAR(std::sqrt(1 / static_cast<double>(o.at(0, 0)[0]) - 1), 0.5, 0.035) << width << " " << distance;
      }
    }
}

TEST(Horizon, DirectionsAreThoseOfTheImage) {
  // Something tall to the right hides B0 most; above (smaller y) B1; below B2.
  const auto post = [](int px, int py) {
    return fields::make(64, 64, false,
                        [=](int x, int y) { return std::abs(x - px) <= 2 && std::abs(y - py) <= 2 ? 20.0f : 0.0f; });
  };
  const auto right = at(post(38, 32), 32, 32), up = at(post(29, 27), 32, 32), down = at(post(29, 37), 32, 32);
  EXPECT_LT(right[0], right[1] - 0.05f);
  EXPECT_LT(right[0], right[2] - 0.05f);
  EXPECT_LT(up[1], up[0] - 0.05f);
  EXPECT_LT(up[1], up[2] - 0.05f);
  EXPECT_LT(down[2], down[0] - 0.05f);
  EXPECT_LT(down[2], down[1] - 0.05f);
}

TEST(Horizon, WrapsSeamlesslyAndWithoutWrapItEnds) {
  // A wall along the left edge, seen from the right edge: only a map that tiles has it there.
  for (bool wrap : {true, false}) {
    const HeightField field = fields::make(50, 30, wrap, [](int x, int) { return x < 3 ? 10.0f : 0.0f; });
    const auto o = at(field, 49, 15);
    if (wrap)
      EXPECT_LT(o[0], 0.3f);
    else
      EXPECT_GT(o[0], 0.97f);  // the wall is still there in the west, 47 texels away
  }
  // Moving the map around its torus moves the result, by multiples of the largest cell exactly.
  const HeightField a = fields::fractal(96, 64, 20);
  const HeightField b = fields::make(96, 64, true, [&](int x, int y) { return a.at(x + 32, y + 32); });
  const Image oa = Horizon(a, {}).occlusion({0, 0, 96, 64}, allLobes()),
              ob = Horizon(b, {}).occlusion({0, 0, 96, 64}, allLobes());
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x)
      for (int c = 0; c < 4; ++c) ASSERT_EQ(ob.at(x, y)[c], oa.at((x + 32) % 96, (y + 32) % 64)[c]) << x << " " << y;
}

TEST(Horizon, OddAndTinySizes) {
  for (const auto& [w, h] : {std::pair{1, 7}, {2, 2}, {3, 5}, {65, 1}, {127, 31}})
    for (bool wrap : {true, false}) {
      HeightField field = fields::make(w, h, wrap, [](int x, int y) {
        return 3 * fields::hashUnit(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 1);
      });
      const Image o = Horizon(field, {}).occlusion({0, 0, w, h}, allLobes());
      for (float v : o.pixels) {
        ASSERT_GE(v, 0.0f);
        ASSERT_LE(v, 1.0f);
      }
    }
}

TEST(Horizon, SameBitsForAnyThreadsTilesAndVectorWidth) {
  const HeightField field = fields::fractal(150, 90, 30);
  const Image whole = Horizon(field, {}).occlusion({0, 0, 150, 90}, allLobes());
  for (int threads : {1, 3}) {
    ThreadLimit limit(threads);
    EXPECT_EQ(Horizon(field, {}).occlusion({0, 0, 150, 90}, allLobes()).pixels, whole.pixels);
  }
  for (SimdLevel level : {SimdLevel::Baseline, SimdLevel::Avx2, SimdLevel::Avx512}) {
    if (level > bestSimdLevel()) continue;
    HorizonSettings settings;
    settings.simd = level;
    EXPECT_EQ(Horizon(field, settings).occlusion({0, 0, 150, 90}, allLobes()).pixels, whole.pixels);
  }
  const Horizon horizon(field, {});
  for (const TexelRect& rect : {TexelRect{17, 5, 70, 31}, TexelRect{0, 89, 150, 1}, TexelRect{149, 0, 1, 90}}) {
    const Image part = horizon.occlusion(rect, allLobes());
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x)
        for (int c = 0; c < 4; ++c) ASSERT_EQ(part.at(x, y)[c], whole.at(rect.x + x, rect.y + y)[c]);
  }
}

TEST(Horizon, ReachLimitsWhatOccludes) {
  const HeightField wall = fields::make(128, 128, false, [](int x, int) { return x >= 100 ? 40.0f : 0.0f; });
  for (float v : at(wall, 40, 64, {.azimuths = 32, .reach = 50})) EXPECT_NEAR(v, 1, 1e-6);
  EXPECT_LT(at(wall, 40, 64, {.azimuths = 32, .reach = 80})[0], 0.8f);
}

TEST(Horizon, HigherReliefTakesMoreAzimuths) {
  HeightField field;
  field.highest = 32;
  EXPECT_EQ(automaticAzimuths(field), 48);
  field.lowest = -1;
  EXPECT_EQ(automaticAzimuths(field), 64);
}

}  // namespace
}  // namespace lumel::ssbump
