#include "baker/gather/gather_guide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "baker/gather/gather_kernels.h"

namespace lumel {
namespace {

struct Aimed {
  Vec3 dir{0};
  float stretch = 0.0f;
  float weight = 0.0f;
  Vec2 point{0};  // before it is stretched
};

/// The directions that a guide makes of a net, of 16 texels with the same frame.
std::vector<Aimed> aimed(const Guide& guide, int log2Count, std::uint64_t seed = 1) {
  std::array<TexelSampler, kLanes> samplers;
  std::array<bool, kLanes> all;
  all.fill(true);
  const LaneFlags active{};
  Vec3Lanes origin, ng;
  FrameLanes frame;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    samplers[lane] = TexelSampler(seed, 0, lane, 0);
    ng.set(lane, {0, 0, 1});
    frame.set(lane, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  }
  const auto net = std::make_unique<NetLanes>();
  net->fill(samplers, all, {0, log2Count}, 0);
  const GuideTable table(guide);
  std::vector<Aimed> result;
  for (std::uint32_t cell = 0; cell < net->net().count(); ++cell) {
    AimedRays rays;
    const GuidedPoints points = guidedPoints(*net, cell);
    aimGatherRays(points, table, {active, origin, origin, frame, ng}, rays);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      result.push_back({rays.dirTangent[lane], rays.stretch[lane], rays.weight[lane], {points.x[lane], points.y[lane]}});
  }
  return result;
}

/// What `light` looks like to so many rays that go everywhere alike.
template <class Light>
GuideTally tallied(Light light, std::uint32_t rays = 4096) {
  GuideTally tally;
  for (std::uint32_t i = 0; i < rays; ++i) {
    const Vec2 u = sobol2D(i, 77);
    const Vec3 w = sampleGatherHemisphere(u);
    tally.add(guideBin(w.z, u.y), light(w));
  }
  return tally;
}

const RnmKernels& kernels() {
  static const RnmKernels made(Projection::Raw);
  return made;
}

/// A bright disc, a sixtieth of the hemisphere.
float disc(const Vec3& w) { return glm::dot(w, glm::normalize(Vec3(0.5f, 0.3f, 0.6f))) > 0.983f ? 50.0f : 1.0f; }

TEST(GatherGuide, BinsAreThoseOfTheSquare) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Vec2 u = sobol2D(i, 3);
    const auto row = static_cast<std::uint32_t>(u.x * kGuideRows), column = static_cast<std::uint32_t>(u.y * kGuideColumns);
    EXPECT_EQ(guideBin(sampleGatherHemisphere(u).z, u.y), row * kGuideColumns + column);
  }
  EXPECT_EQ(guideBin(1.0f, 0.0f), 0u);
  EXPECT_EQ(guideBin(0.0f, 1.0f), kGuideBins - 1);
}

TEST(GatherGuide, AnEvenOneChangesNothing) {
  for (int log2Count = 0; log2Count <= 10; ++log2Count)
    for (const Aimed& ray : aimed(Guide(), log2Count)) {
      ASSERT_EQ(ray.dir, sampleGatherHemisphere(ray.point));
      ASSERT_EQ(ray.stretch, 1.0f);
    }
}

// Where the rays go changes no mean, of whatever nets: to 1e-3 with 16 nets of 1024 points, and to three standard
// deviations, 0.02, with as many points in small nets.
TEST(GatherGuide, MeansStay) {
  const GuideMaker maker(kernels());
  const auto lightOf = [](int kind, const Vec3& w) {
    return kind == 0 ? disc(w) : kind == 1 ? (w.x > 0.2f ? 3.0f : 0.0f) : w.z * w.z;
  };
  for (int kind = 0; kind < 3; ++kind) {
    const Guide guide = maker.make(tallied([&](const Vec3& w) { return lightOf(kind, w); }));
    for (const int log2Count : {3, 4, 5, 6, 10}) {
      double area = 0, cosine = 0, rnm = 0;
      for (std::uint64_t seed = 0; seed < 1024u >> log2Count; ++seed)
        for (const Aimed& ray : aimed(guide, log2Count, seed)) {
          area += static_cast<double>(ray.stretch) / (1024 * kLanes);
          cosine += static_cast<double>(ray.weight * ray.dir.z) / (1024 * kLanes);
          rnm += static_cast<double>(ray.weight * kernels()(ray.dir).y) / (1024 * kLanes);
        }
      const double tolerance = log2Count == 10 ? 1e-3 : 0.02;
      EXPECT_NEAR(area, 1.0, tolerance) << kind << ' ' << log2Count;
      EXPECT_NEAR(cosine, 1.0, tolerance) << kind << ' ' << log2Count;
      EXPECT_NEAR(rnm, 0.5 + 0.5 * std::sqrt(1.0 / 3.0), tolerance) << kind << ' ' << log2Count;
    }
  }
}

// The disc found by 1152 rays, as many as a wave and those around it have: nets of 64 then err by less than two thirds,
// and no part of the hemisphere is left without rays.
TEST(GatherGuide, RaysGoWhereLightDiffers) {
  const Guide guide = GuideMaker(kernels()).make(tallied(disc, 1152));
  const auto errorOf = [&](const Guide& by) {
    double truth = 0, squares = 0;
    const auto fine = aimed(Guide(), 10, 99);
    for (const Aimed& ray : fine) truth += static_cast<double>(ray.weight * ray.dir.z * disc(ray.dir)) / (1024.0 * kLanes);
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      const auto rays = aimed(by, 6, seed);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        double sum = 0;
        for (std::size_t i = lane; i < rays.size(); i += kLanes)
          sum += static_cast<double>(rays[i].weight * rays[i].dir.z * disc(rays[i].dir)) / 64.0;
        squares += (sum - truth) * (sum - truth) / (40.0 * kLanes);
      }
    }
    return std::sqrt(squares);
  };
  EXPECT_LT(errorOf(guide), 0.67 * errorOf(Guide()));
  std::array<int, kGuideBins> found{};
  const auto rays = aimed(guide, 10);
  for (const Aimed& ray : rays) ++found[guideBin(ray.dir.z, invertGatherHemisphere(ray.dir).y)];
  for (const int count : found) EXPECT_GT(count, 0.1 * static_cast<double>(rays.size()) / kGuideBins);
}

// Even light is worth looking at where its part in the maps differs, but nowhere by much.
TEST(GatherGuide, EvenLightHasNearlyEvenRays) {
  for (const Aimed& ray : aimed(GuideMaker(kernels()).make(tallied([](const Vec3&) { return 2.0f; })), 6)) {
    EXPECT_GT(ray.stretch, 0.5f);
    EXPECT_LT(ray.stretch, 3.0f);
  }
}

TEST(GatherGuide, WhateverWasFoundItIsAMapOfTheSquare) {
  const GuideMaker maker(kernels());
  const auto isEven = [](const Guide& guide) { return guide.rows == Guide().rows && guide.columns == Guide().columns; };
  EXPECT_TRUE(isEven(maker.make({})));
  EXPECT_TRUE(isEven(maker.make(tallied([](const Vec3&) { return 0.0f; }))));
  EXPECT_TRUE(isEven(maker.make(tallied([](const Vec3&) { return 1e30f; }))));
  EXPECT_TRUE(isEven(maker.make(tallied([](const Vec3&) { return std::numeric_limits<float>::quiet_NaN(); }))));
  for (const float brightness : {1e-15f, 1.0f, 1e15f})
    for (std::uint32_t bin = 0; bin < kGuideBins; ++bin) {
      GuideTally tally;
      tally.add(bin, brightness);
      tally.add(bin, 0.0f);
      const Guide guide = maker.make(tally);
      std::uint32_t before = 0;
      for (const std::uint16_t knot : guide.rows) {
        EXPECT_GT(knot, before);
        before = knot;
      }
      for (const auto& row : guide.columns) {
        before = 0;
        for (const std::uint16_t knot : row) {
          EXPECT_GT(knot, before);
          before = knot;
        }
      }
      for (const Aimed& ray : aimed(guide, 6)) {
        ASSERT_GT(ray.stretch, 0.0f);
        ASSERT_LT(ray.stretch, 50.0f);
      }
    }
}

}  // namespace
}  // namespace lumel
