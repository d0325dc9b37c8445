#include "baker/rays/sampling.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "baker/light/distribution.h"
#include "lightmap/maps/rnm_basis.h"
#include "scene/base/sobol.h"

namespace lumel {
namespace {

struct HemisphereSampler {
  const char* name;
  Vec3 (*sample)(Vec2);
  float (*pdf)(float);
  Vec2 (*invert)(const Vec3&);
};

const HemisphereSampler kSamplers[] = {
    {"cosine", sampleCosineHemisphere, cosineHemispherePdf, invertCosineHemisphere},
    {"gather", sampleGatherHemisphere, gatherHemispherePdf, invertGatherHemisphere},
};

TEST(Sampling, HemisphereRoundTrips) {
  for (const auto& s : kSamplers)
    for (std::uint32_t i = 0; i < 4096; ++i) {
      const Vec2 u = sobol2D(i, 1);
      const Vec3 w = s.sample(u);
      EXPECT_NEAR(glm::length(w), 1.0f, 2e-6f) << s.name;
      ASSERT_GT(w.z, 0.0f) << s.name;
      const Vec2 back = s.invert(w);
      // Near the horizon and the pole the inverse loses digits of float: 1e-5 in x; in azimuth 1e-4 and around.
      EXPECT_NEAR(back.x, u.x, 1e-5f) << s.name;
      const float turn = std::abs(back.y - u.y);
      if (w.z < 0.999f) {
        EXPECT_LT(std::min(turn, 1.0f - turn), 1e-4f) << s.name;
      }
    }
}

TEST(Sampling, HemispherePdfsIntegrateToOne) {
  for (const auto& s : kSamplers) {
    double sum = 0;  // over z by midpoints: Integral 2 pi p(z) dz
    for (int i = 0; i < 1000; ++i)
      sum += 2 * std::numbers::pi * static_cast<double>(s.pdf((static_cast<float>(i) + 0.5f) / 1000)) / 1000;
    EXPECT_NEAR(sum, 1.0, 1e-5) << s.name;
    EXPECT_EQ(s.pdf(0.0f), 0.0f);
    EXPECT_EQ(s.pdf(-0.5f), 0.0f);
  }
}

// Counts per cell of (z, azimuth) against the integral of the density over the cell; exact up to the cells' borders
// because the points are a net.
TEST(Sampling, HemisphereHistogramsMatchTheirPdf) {
  constexpr int kZ = 8, kTurn = 8, kSamples = 1 << 16;
  for (const auto& s : kSamplers) {
    std::array<std::array<double, kTurn>, kZ> histogram{};
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const Vec3 w = s.sample(sobol2D(i, 9));
      const auto z = static_cast<std::size_t>(std::min(kZ - 1.0f, w.z * kZ));
      const auto turn = static_cast<std::size_t>(std::min(kTurn - 1.0f, turnOf(w) * kTurn));
      histogram[z][turn] += 1.0 / kSamples;
    }
    for (int z = 0; z < kZ; ++z) {
      double expected = 0;
      for (int k = 0; k < 64; ++k)
        expected += 2 * std::numbers::pi *
                    static_cast<double>(s.pdf((static_cast<float>(z) + (static_cast<float>(k) + 0.5f) / 64) / kZ)) /
                    (64.0 * kZ * kTurn);
      for (int t = 0; t < kTurn; ++t)
        EXPECT_NEAR(histogram[static_cast<std::size_t>(z)][static_cast<std::size_t>(t)], expected, 4e-4)
            << s.name << " z " << z << " turn " << t;
    }
  }
}

TEST(Sampling, GatherWeightsAreBoundedForEveryBasisVector) {
  float mostFlat = 0, mostTilted = 0;
  for (std::uint32_t i = 0; i < 65536; ++i) {
    const Vec3 w = sampleGatherHemisphere(sobol2D(i, 3));
    const float pdf = gatherHemispherePdf(w.z);
    mostFlat = std::max(mostFlat, w.z * kInvPi / pdf);
    for (const Vec3& basis : kRnmBasis) mostTilted = std::max(mostTilted, glm::dot(w, basis) * kInvPi / pdf);
  }
  EXPECT_LE(mostFlat, 4.0f / 3 + 1e-5f);
  EXPECT_LE(mostTilted, 4 * std::sqrt(2.0f / 3) + 1e-5f);
}

TEST(Sampling, TriangleRoundTripsAndIsUniform) {
  double x = 0, y = 0;
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const Vec2 u = sobol2D(i, 5);
    const Vec2 b = sampleTriangle(u);
    ASSERT_GE(b.x, 0.0f);
    ASSERT_GE(b.y, 0.0f);
    ASSERT_LE(b.x + b.y, 1.0f);
    const Vec2 back = invertTriangle(b);
    EXPECT_NEAR(back.x, u.x, 1e-6f);
    if (u.x > 1e-4f) {
      EXPECT_NEAR(back.y, u.y, 1e-4f);
    }
    x += static_cast<double>(b.x);
    y += static_cast<double>(b.y);
  }
  EXPECT_NEAR(x / 4096, 1.0 / 3, 1e-3);
  EXPECT_NEAR(y / 4096, 1.0 / 3, 1e-3);
}

TEST(Sampling, MisWeightsOfTwoTechniquesSumToOne) {
  EXPECT_FLOAT_EQ(misWeight(2, 3) + misWeight(3, 2), 1.0f);
  EXPECT_EQ(misWeight(1, 0), 1.0f);
  EXPECT_EQ(misWeight(1, std::numeric_limits<float>::infinity()), 0.0f);
}

/// What one number chooses.
struct Chosen {
  std::size_t index;
  float rest;
};
Chosen choose(const Distribution& d, float u) {
  std::array<float, kLanes> numbers;
  numbers.fill(u);
  Distribution::Lanes lanes;
  d.choose(numbers.data(), lanes);
  return {static_cast<std::size_t>(lanes.index[0]), lanes.rest[0]};
}

TEST(Distribution, ProbabilityIsExactlyTheShareOfChoices) {
  const std::vector<float> weights = {0.0f, 3.0f, 1e-12f, 0.0f, 5.0f, 2.0f, 0.0f};
  const Distribution d(weights);
  ASSERT_EQ(d.size(), weights.size());
  float sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += d.probability(i);
    EXPECT_EQ(d.probability(i) > 0, weights[i] > 0) << i;
  }
  EXPECT_EQ(sum, 1.0f);
  EXPECT_NEAR(d.probability(1), 0.3f, 1e-6f);
  std::vector<std::uint32_t> counts(weights.size());
  for (std::uint32_t k = 0; k < (1u << 24); k += kLanes) {
    std::array<float, kLanes> u;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) u[lane] = static_cast<float>(k + lane) * 0x1p-24f;
    Distribution::Lanes chosen;
    d.choose(u.data(), chosen);
    for (const int index : chosen.index) ++counts[static_cast<std::size_t>(index)];
  }
  for (std::size_t i = 0; i < weights.size(); ++i)
    EXPECT_EQ(static_cast<float>(counts[i]) * 0x1p-24f, d.probability(i)) << i;
}

TEST(Distribution, RestReusesTheNumber) {
  const std::vector<float> weights = {1.0f, 3.0f};
  const Distribution d(weights);
  EXPECT_EQ(choose(d, 0.1f).index, 0u);
  EXPECT_NEAR(choose(d, 0.125f).rest, 0.5f, 1e-6f);
  EXPECT_EQ(choose(d, 0.9f).index, 1u);
  EXPECT_NEAR(choose(d, 0.625f).rest, 0.5f, 1e-6f);
  EXPECT_LT(choose(d, 0x1.fffffep-1f).rest, 1.0f);
}

// 1000 weights, not a power of two, so that u times their number is rounded; the last u is the one that would round up
// to 1000. What is chosen holds u.
TEST(Distribution, LanesChooseWhatHoldsTheirNumber) {
  for (const float few : {1.0f, 1e-9f}) {  // in the second most of a guide's places point to the end
    std::vector<float> weights(1000, 1.0f);
    std::fill(weights.begin(), weights.begin() + 900, few);
    const Distribution d(weights);
    for (std::uint32_t i = 0; i < 4096; ++i) {
      std::array<float, kLanes> u;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        u[lane] = sobol1D(i * kLanes + static_cast<std::uint32_t>(lane), 3);
      if (i == 0) u[0] = 0.0f;
      if (i == 1) u[0] = 0x1.fffffep-1f;
      Distribution::Lanes chosen;
      d.choose(u.data(), chosen);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto index = static_cast<std::size_t>(chosen.index[lane]);
        float before = 0.0f;  // sums of multiples of 2^-24 are exact
        for (std::size_t k = 0; k < index; ++k) before += d.probability(k);
        ASSERT_LE(before, u[lane]);
        ASSERT_LT(u[lane], before + d.probability(index));
      }
    }
  }
}

// Rows of any length that a table may have: every step of the grid is chosen by the index that holds it, the rest of u
// goes from 0 to 1 within, and shares are as close to the weights as promised.
TEST(DistributionRows, ProbabilityIsExactlyTheShareOfChoices) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{512}, std::size_t{1000}, std::size_t{2048},
                                 DistributionRows::kMostWeights}) {
    constexpr std::size_t kRows = 5;
    std::vector<float> weights(kRows * size);
    for (std::uint32_t i = 0; i < size; ++i) {
      weights[i] = 1.0f;
      weights[size + i] = unitFloat(hashCombine(i, 7));
      weights[2 * size + i] = i + 1 == size ? 1.0f : 1e-12f;
      weights[3 * size + i] = i % 3 == 1 || size == 1 ? 1.0f : 0.0f;  // nothing at the ends
      weights[4 * size + i] = -1.0f;
    }
    const DistributionRows d(weights, kRows);
    EXPECT_TRUE(d.empty(4));
    for (std::size_t row = 0; row < 4; ++row) {
      float whole = 0.0f;
      for (std::size_t i = 0; i < size; ++i) {
        const float weight = weights[row * size + i], share = d.probability(i, row);
        whole += share;
        ASSERT_EQ(share > 0.0f, weight > 0.0f);
        const float due = weight / static_cast<float>(d.total(row));
        ASSERT_NEAR(share, due, 0x1p-15f * (1.001f + static_cast<float>(size) * due)) << size << ' ' << row << ' ' << i;
      }
      ASSERT_EQ(whole, 1.0f);
      LaneFlags rows;
      rows.fill(static_cast<int>(row));
      std::vector<int> counts(size);
      float restBefore = 0.0f;
      int before = 0;
      for (std::uint32_t k = 0; k < (1u << 16); k += kLanes) {
        std::array<float, kLanes> u;
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) u[lane] = static_cast<float>(k + lane) * 0x1p-16f;
        Distribution::Lanes chosen;
        d.choose(u.data(), rows, chosen);
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          ++counts[static_cast<std::size_t>(chosen.index[lane])];
          ASSERT_GE(chosen.index[lane], before);
          if (chosen.index[lane] != before) restBefore = 0.0f;
          ASSERT_GE(chosen.rest[lane], restBefore);
          ASSERT_LT(chosen.rest[lane], 1.0f);
          before = chosen.index[lane];
          restBefore = chosen.rest[lane];
        }
      }
      for (std::size_t i = 0; i < size; ++i)
        ASSERT_EQ(static_cast<float>(counts[i]) * 0x1p-16f, d.probability(i, row)) << size << ' ' << row << ' ' << i;
    }
  }
}

TEST(Distribution, DegenerateWeights) {
  EXPECT_TRUE(Distribution().empty());
  EXPECT_TRUE(Distribution(std::vector<float>{}).empty());
  EXPECT_TRUE(Distribution(std::vector<float>{0, 0}).empty());
  EXPECT_TRUE(Distribution(std::vector<float>{-1, std::nanf("")}).empty());
  const Distribution one(std::vector<float>{std::nanf(""), 2.0f});
  EXPECT_EQ(choose(one, 0.0f).index, 1u);
  EXPECT_EQ(choose(one, 0x1.fffffep-1f).index, 1u);
  EXPECT_EQ(one.probability(1), 1.0f);
}

std::vector<SphericalTriangle> sphericalTriangles() {
  const auto at = [](double x, double y, double z) { return glm::normalize(Vec3d(x, y, z)); };
  return {
      {at(1, 0, 0), at(0, 1, 0), at(0, 0, 1)},                    // an octant
      {at(1, 0, 0.1), at(-1, 0.2, 0.1), at(-0.8, -1, 0.1)},       // nearly a hemisphere
      {at(1, 0, 4), at(0.9, 0.2, 4), at(1.1, 0.1, 4)},            // small
      {at(-5, 0.01, 1), at(5, 0.01, 1), at(0, -0.01, 1)},         // long and thin
      {at(0, 0, 1), at(0.003, 0, 1), at(3, 0.3, 1)},              // a needle
      {at(1e-3, 0, 1), at(-1e-3, 1e-3, 1), at(-1e-3, -1e-3, 1)},  // tiny
  };
}

TEST(SphericalTriangle, SolidAngles) {
  const std::vector<SphericalTriangle> triangles = sphericalTriangles();
  EXPECT_NEAR(triangles[0].solidAngle(), std::numbers::pi / 2, 1e-12);
  // Seen from straight above, a tiny triangle's solid angle is its area.
  EXPECT_NEAR(triangles[5].solidAngle() / 2e-6, 1.0, 1e-5);
  // In float as in double, from the edges.
  const Vec3 a(0.3f, 0.2f, 2.0f), e1(0.02f, 0, 0), e2(0, 0.03f, 0.01f);
  const SphericalTriangle same{glm::normalize(Vec3d(a)), glm::normalize(Vec3d(a + e1)), glm::normalize(Vec3d(a + e2))};
  const float angle = triangleSolidAngle(a, a + e1, a + e2, std::abs(glm::dot(a, glm::cross(e1, e2))));
  EXPECT_NEAR(static_cast<double>(angle) / same.solidAngle(), 1.0, 1e-5);
  EXPECT_EQ(triangleSolidAngle(a, a, a, 0.0f), 0.0f);
}

TEST(SphericalTriangle, RoundTrips) {
  for (const SphericalTriangle& triangle : sphericalTriangles())
    for (std::uint32_t i = 0; i < 512; ++i) {
      const Vec2 u = sobol2D(i, 3);
      const Vec3d w = triangle.sample(u, triangle.solidAngle(), triangle.volume());
      EXPECT_NEAR(glm::length(w), 1.0, 1e-9);
      const Vec2 back = triangle.invert(w);
      // Near the corner b all u.x meet.
      EXPECT_NEAR(back.x, u.x, 1e-4f / std::max(0.01f, std::sqrt(u.y)));
      EXPECT_NEAR(back.y, u.y, 1e-4f);
    }
}

// What light sampling uses: in float the samples of triangles of 0.03 steradians and more are those in double.
TEST(SphericalTriangle, FloatAsDouble) {
  const std::vector<SphericalTriangle> triangles = sphericalTriangles();
  const SphericalTriangle least{glm::normalize(Vec3d(0.9, 0.1, 3)), glm::normalize(Vec3d(1.5, 0.1, 3)),
                                glm::normalize(Vec3d(1, 1.2, 3))};
  EXPECT_NEAR(least.solidAngle(), 0.03, 0.004);
  for (const SphericalTriangle& triangle : {triangles[0], triangles[1], least}) {
    const SphericalTriangleOf<float> same{Vec3(triangle.a), Vec3(triangle.b), Vec3(triangle.c)};
    EXPECT_NEAR(same.solidAngle() / triangle.solidAngle(), 1.0, 1e-5);
    for (std::uint32_t i = 0; i < 512; ++i) {
      const Vec2 u = sobol2D(i, 3);
      const Vec3d exact = triangle.sample(u, triangle.solidAngle(), triangle.volume());
      const Vec3 w = same.sample(u, static_cast<float>(triangle.solidAngle()), static_cast<float>(triangle.volume()));
      // A few roundings of 6e-8, divided by the width of the smallest.
      EXPECT_LT(glm::distance(Vec3d(w), exact), 1e-5);
    }
  }
}

TEST(SphericalTriangle, AngleAbove) {
  EXPECT_EQ(angleAbove(0.0f, 0.0f), 0.0f);
  for (int i = 0; i <= 1000; ++i) {
    const double angle = std::numbers::pi * i / 1000.0;
    const auto y = static_cast<float>(std::abs(std::sin(angle))), x = static_cast<float>(std::cos(angle));
    EXPECT_NEAR(static_cast<double>(angleAbove(y, x)), std::atan2(static_cast<double>(y), static_cast<double>(x)),
                5e-7);
  }
}

// The four triangles between the corners and the edges' midpoints receive samples by their solid angle, on two levels.
TEST(SphericalTriangle, UniformBySolidAngle) {
  const auto split = [](const SphericalTriangle& t) {
    const Vec3d ab = glm::normalize(t.a + t.b), bc = glm::normalize(t.b + t.c), ca = glm::normalize(t.c + t.a);
    return std::array<SphericalTriangle, 4>{{{t.a, ab, ca}, {ab, t.b, bc}, {ca, bc, t.c}, {ab, bc, ca}}};
  };
  const auto holds = [](const SphericalTriangle& t, const Vec3d& w) {
    const double turn = glm::dot(t.a, glm::cross(t.b, t.c)) < 0 ? -1 : 1;
    return turn * glm::dot(w, glm::cross(t.a, t.b)) >= 0 && turn * glm::dot(w, glm::cross(t.b, t.c)) >= 0 &&
           turn * glm::dot(w, glm::cross(t.c, t.a)) >= 0;
  };
  constexpr int kSamples = 1 << 14;
  for (const SphericalTriangle& triangle : sphericalTriangles()) {
    std::vector<SphericalTriangle> parts;
    for (const SphericalTriangle& part : split(triangle))
      for (const SphericalTriangle& small : split(part)) parts.push_back(small);
    std::vector<int> counts(parts.size());
    int inside = 0;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const Vec3d w = triangle.sample(sobol2D(i, 4), triangle.solidAngle(), triangle.volume());
      for (std::size_t k = 0; k < parts.size(); ++k)
        if (holds(parts[k], w)) {
          ++counts[k];
          ++inside;
          break;
        }
    }
    EXPECT_GE(inside, kSamples - 20);  // the rest within rounding of an edge
    for (std::size_t k = 0; k < parts.size(); ++k)
      // A stratified sequence: errors grow with the length of the border, about the root of the number.
      EXPECT_NEAR(counts[k], kSamples * parts[k].solidAngle() / triangle.solidAngle(), 40.0) << k;
  }
}

}  // namespace
}  // namespace lumel
