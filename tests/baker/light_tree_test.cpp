// The choice among many lights: its densities add up to one, are those of the samples, and leave no light out.
#include "baker/light/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "baker/light/emissive_triangles.h"
#include "baker/light/punctual_lights.h"
#include "tests/baker/one_sample.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float unit() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  float in(float least, float most) { return least + (most - least) * unit(); }
  Vec3 inBox(float half) { return {in(-half, half), in(-half, half), in(-half, half)}; }
  Vec3 direction() {
    for (;;)
      if (const Vec3 v = inBox(1.0f); glm::dot(v, v) > 1e-3f && glm::dot(v, v) < 1.0f) return glm::normalize(v);
  }

 private:
  std::mt19937 engine_;
};

LightBounds pointAt(const Vec3& p, float power = 1.0f) {
  return {.min = p, .max = p, .cosSpread = -1.0f, .power = power};
}

/// Points, flat patches and spots of many sizes and powers.
std::vector<LightBounds> mixture(std::size_t count, Random& random) {
  std::vector<LightBounds> lights;
  for (std::size_t i = 0; i < count; ++i) {
    LightBounds light = pointAt(random.inBox(5.0f), std::exp(random.in(-4, 4)));
    light.axis = random.direction();
    if (i % 3 == 1) {
      light.max += Vec3(random.unit(), random.unit(), random.unit());
      light.cosSpread = 1.0f;
    } else if (i % 3 == 2) {
      light.cosSpread = random.in(-0.5f, 1.0f);
      light.cosEmit = 0.9998f;
    }
    if (i % 7 == 0) light.reach = random.in(1, 10);
    lights.push_back(light);
  }
  return lights;
}

/// What one number chooses.
template <class Importance>
LightTree::Choice choose(const LightTree& tree, const LightQuery& query, float u, Importance importance) {
  Vec3Lanes p, n;
  p.set(0, query.p);
  n.set(0, query.n);
  const std::array<float, kLanes> numbers{u};
  LightTree::Descent descent;
  tree.descend(p, query.n == Vec3(0.0f) ? nullptr : &n, {1}, numbers.data(), descent);
  return tree.chooseInLeaf(descent, 0, importance);
}

// Lanes in step, some of them without a point, end where each would by itself, with the probability that is stated for
// their light; a tree of one leaf has no step to take.
TEST(LightTree, LanesDescendAsSinglePointsDo) {
  Random random(4);
  for (const auto& [count, bounded] : {std::pair{3, true}, std::pair{300, true}, std::pair{300, false}}) {
    std::vector<LightBounds> lights = mixture(static_cast<std::size_t>(count), random);
    if (!bounded)
      for (LightBounds& light : lights) light.reach = std::numeric_limits<float>::infinity();
    const LightTree tree(lights);
    const auto importance = [&](std::uint32_t light) { return lights[light].power; };
    for (int trial = 0; trial < 200; ++trial) {
      Vec3Lanes p, n;
      LaneFlags active;
      std::array<float, kLanes> u;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        p.set(lane, random.inBox(6.0f));
        n.set(lane, trial % 2 ? random.direction() : Vec3(0.0f));
        active[lane] = lane != 3;
        u[lane] = random.unit();
      }
      LightTree::Descent descent;
      tree.descend(p, trial % 2 ? &n : nullptr, active, u.data(), descent);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const LightTree::Choice choice = tree.chooseInLeaf(descent, lane, importance);
        if (!active[lane]) {
          EXPECT_EQ(choice.probability, 0.0f);
          continue;
        }
        const LightQuery query{p[lane], n[lane]};
        const LightTree::Choice one = choose(tree, query, u[lane], importance);
        EXPECT_EQ(choice.probability, one.probability);
        if (!(choice.probability > 0.0f)) continue;
        EXPECT_EQ(choice.light, one.light);
        // A product of a dozen shares, rounded.
        EXPECT_NEAR(tree.probability(query, choice.light, importance) / choice.probability, 1.0f, 1e-5f);
      }
    }
  }
}

TEST(LightTree, ProbabilitiesAddUpToOneAndMatchFrequencies) {
  Random random(1);
  const std::vector<LightBounds> lights = mixture(300, random);
  const LightTree tree(lights);
  const auto even = [](std::uint32_t) { return 1.0f; };
  for (int trial = 0; trial < 6; ++trial) {
    const LightQuery query{random.inBox(6.0f), trial % 2 ? random.direction() : Vec3(0.0f)};
    double sum = 0;
    std::vector<double> expected(lights.size());
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
      expected[i] = static_cast<double>(tree.probability(query, i, even));
      sum += expected[i];
    }
    // Groups may turn out to bring nothing when their halves are looked at.
    EXPECT_LE(sum, 1.0 + 1e-5);
    EXPECT_GT(sum, 0.8);
    constexpr int kSamples = 100000;
    std::vector<int> counts(lights.size());
    int none = 0;
    for (int i = 0; i < kSamples; ++i) {
      const LightTree::Choice choice = choose(tree, query, random.unit(), even);
      if (!(choice.probability > 0.0f)) {
        ++none;
        continue;
      }
      ++counts[choice.light];
      ASSERT_NEAR(static_cast<double>(choice.probability) / expected[choice.light], 1.0, 1e-5);
    }
    EXPECT_NEAR(none, kSamples * (1 - sum), 5 * std::sqrt(kSamples * std::abs(1 - sum)) + 5);
    // Chi-square; lights that are expected fewer than 5 times are one class.
    double statistic = 0, rareExpected = 0;
    int classes = 0, rare = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const double mean = expected[i] * kSamples;
      if (mean < 5) {
        rareExpected += mean;
        rare += counts[i];
        continue;
      }
      statistic += (counts[i] - mean) * (counts[i] - mean) / mean;
      ++classes;
    }
    EXPECT_LT(std::abs(rare - rareExpected), 5 * std::sqrt(rareExpected) + 5);
    // Five standard deviations of the statistic.
    EXPECT_LT(statistic, classes + 5 * std::sqrt(2.0 * classes)) << classes << " classes";
  }
}

TEST(LightTree, Degenerate) {
  const auto even = [](std::uint32_t) { return 1.0f; };
  const LightQuery query{{0, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(LightTree().empty());
  EXPECT_EQ(LightTree().importance(query), 0.0f);

  const std::vector<LightBounds> one = {pointAt({0, 1, 0})};
  EXPECT_EQ(choose(LightTree(one), query, 0.999f, even).probability, 1.0f);
  EXPECT_EQ(LightTree(one).probability(query, 0, even), 1.0f);
  EXPECT_EQ(LightTree(one).probability(query, 1, even), 0.0f);

  // Without power, or with one that is no number: never chosen, and no harm to others.
  std::vector<LightBounds> odd = {pointAt({0, 1, 0}, 0.0f), pointAt({0, 1, 0}, -1.0f),
                                  pointAt({0, 1, 0}, std::nanf("")), pointAt({0, 1, 0}, INFINITY),
                                  pointAt({0, 1, 0}, 2.0f)};
  EXPECT_EQ(choose(LightTree(odd), query, 0.0f, even).light, 4u);
  EXPECT_EQ(LightTree(odd).probability(query, 0, even), 0.0f);
  odd.pop_back();
  EXPECT_TRUE(LightTree(odd).empty());

  // All in one place: halved by number, and each as likely as any other.
  const LightTree pile(std::vector<LightBounds>(10000, pointAt({0, 1, 0})));
  double sum = 0;
  for (std::uint32_t i = 0; i < 10000; ++i) sum += static_cast<double>(pile.probability(query, i, even));
  EXPECT_NEAR(sum, 1.0, 1e-4);
  EXPECT_NEAR(static_cast<double>(pile.probability(query, 5000, even)), 1e-4, 2e-6);

  // Light below the surface, and light at the very point.
  const std::vector<LightBounds> below(100, pointAt({0, -1, 0}));
  EXPECT_EQ(choose(LightTree(below), query, 0.5f, even).probability, 0.0f);
  const std::vector<LightBounds> here(100, pointAt({0, 0, 0}));
  EXPECT_EQ(choose(LightTree(here), query, 0.5f, even).probability, 0.0f);

  // Ever closer together: as deep as trees get.
  std::vector<LightBounds> row;
  for (int i = 0; i < 2000; ++i) row.push_back(pointAt({std::ldexp(1.0f, -(i % 140)), 1, 0}));
  const LightTree deep(row);
  sum = 0;
  for (std::uint32_t i = 0; i < row.size(); ++i) sum += static_cast<double>(deep.probability(query, i, even));
  EXPECT_NEAR(sum, 1.0, 1e-4);
}

Light randomLight(Random& random, int kind) {
  Light light;
  light.position = random.inBox(5.0f);
  light.intensity = std::exp(random.in(-3, 3));
  light.direction = random.direction();
  if (kind == 1) {
    light.type = LightType::Spot;
    light.outerConeAngle = random.in(0.05f, 1.5f);
    light.innerConeAngle = random.in(0.0f, 0.9f) * light.outerConeAngle;
  }
  if (kind == 2) light.range = random.in(1.0f, 8.0f);
  if (kind == 3) light.type = LightType::Directional;
  return light;
}

/// The mean over u of what one sample brings to a point, the directional lights' left out where `near`. The midpoints
/// of a fine grid stand for all u.
double meanBrought(const PunctualLights& lights, const Vec3& p, const Vec3& n, bool near) {
  constexpr int kGrid = 1 << 18;
  LaneFlags active;
  active.fill(1);
  Vec3Lanes points, normals;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    points.set(lane, p);
    normals.set(lane, n);
  }
  const ReceiverLanes at{active, points, normals, normals, points};
  double sum = 0;
  for (int i = 0; i < kGrid; i += kLanes) {
    UnitLanes u;
    for (int lane = 0; lane < kLanes; ++lane) u.u[lane] = (static_cast<float>(i + lane) + 0.5f) / kGrid;
    LightSampleLanes samples;
    near ? lights.sampleNear(at, u, samples) : lights.sample(at, u, samples);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      sum += static_cast<double>(samples.weight.x[lane] * std::max(0.0f, glm::dot(samples.wi[lane], n))) / kGrid;
  }
  return sum;
}

// The mean over u of what samples bring is the sum over all lights: none is left out, and the densities are exact.
TEST(PunctualLights, ManyLightsAgreeWithTheSum) {
  Random random(7);
  for (const int count : {1, 5, 32, 33, 100, 2000}) {
    std::vector<Light> lights;
    for (int i = 0; i < count; ++i) lights.push_back(randomLight(random, i % 40 == 3 ? 3 : i % 3));
    const PunctualLights all(lights);
    ASSERT_EQ(all.size(), lights.size());
    for (int trial = 0; trial < 3; ++trial) {
      const Vec3 p = random.inBox(6.0f);
      const Vec3 n = random.direction();
      double truth = 0, near = 0;
      for (const Light& light : lights) {
        Vec3 wi(0.0f);
        const Vec3 facing = facingIrradiance(light, p, wi);
        const auto brought = static_cast<double>(facing.x * std::max(0.0f, glm::dot(wi, n)));
        truth += brought;
        if (light.type != LightType::Directional) near += brought;
      }
      const double sum = meanBrought(all, p, n, false), sumNear = meanBrought(all, p, n, true);
      // A light's share of u is met to one step of the grid; weights are a few times the mean.
      EXPECT_NEAR(sum, truth, 2e-3 * truth + 1e-6) << count << " lights";
      EXPECT_NEAR(sumNear, near, 2e-3 * near + 1e-6) << count << " lights";
    }
  }
}

// Whatever was learnt, the mean over u is the sum over all lights, those that never arrived included; and a sun that
// was seen to be hidden gets the even share alone.
TEST(PunctualLights, LearntChoicesLeaveNoLightOut) {
  Random random(9);
  for (const int count : {3, 20, 60}) {
    std::vector<Light> lights;
    for (int i = 0; i < count; ++i) {
      lights.push_back(randomLight(random, i == 1 || i == 5 ? 3 : 0));
      lights.back().position.y = 0.5f + std::abs(lights.back().position.y);
    }
    lights[1].intensity = 1e4f;
    lights[1].direction = {0, -1, 0};
    const PunctualLights all(lights);
    LearntChoice learnt(all.groups());
    ASSERT_TRUE(learnt.isUseful());
    for (std::size_t g = 0; g < all.groups(); ++g) learnt.record(g, 2.0f, g % 3 == 2 ? 2.0f : 0.0f);
    for (std::size_t g = 0; g < all.groups(); ++g) learnt.record(g, 6.0f, 0.0f);
    learnt.learn();
    const Vec3 p(0.1f, 0.0f, -0.3f), n(0, 1, 0);
    double truth = 0;
    for (const Light& light : lights) {
      Vec3 wi(0.0f);
      const Vec3 facing = facingIrradiance(light, p, wi);
      truth += static_cast<double>(facing.x * std::max(0.0f, glm::dot(wi, n)));
    }
    LaneFlags active, groups;
    active.fill(1);
    Vec3Lanes points, normals;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      points.set(lane, p);
      normals.set(lane, n);
    }
    constexpr int kGrid = 1 << 16;
    double sum = 0;
    std::vector<int> taken(all.groups());
    for (int i = 0; i < kGrid; i += kLanes) {
      UnitLanes u;
      for (int lane = 0; lane < kLanes; ++lane) u.u[lane] = (static_cast<float>(i + lane) + 0.5f) / kGrid;
      LightSampleLanes samples;
      all.sample({active, points, normals, normals, points}, u, learnt, samples, groups);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        sum += static_cast<double>(samples.weight.x[lane] * std::max(0.0f, glm::dot(samples.wi[lane], n))) / kGrid;
        ++taken[static_cast<std::size_t>(groups[lane])];
      }
    }
    // A light's share of u is met to one step of the grid of 65536, and the least share is .1 / 60 of it.
    EXPECT_NEAR(sum / truth, 1.0, 0.01) << count;
    // The sun is the first light and was never seen to arrive.
    EXPECT_LT(taken[0], 0.11 * kGrid) << count;
    EXPECT_GT(taken[0], 0) << count;
  }
}

// A sun that nothing is known of yet must not starve a lamp that is a thousand times weaker, whatever is known of that.
TEST(PunctualLights, UnknownLightsLeaveOthersTheirShare) {
  Light sun, lamp;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.intensity = 1000.0f;
  lamp.position = {0, 1, 0};
  const PunctualLights lights({sun, lamp});
  for (const bool lampIsKnown : {false, true}) {
    LearntChoice learnt(lights.groups());
    if (lampIsKnown) learnt.record(1, 1.0f, 1.0f);
    learnt.learn();
    LaneFlags active, groups;
    active.fill(1);
    const Vec3Lanes p;
    Vec3Lanes n;
    UnitLanes u;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      n.set(lane, {0, 1, 0});
      u.u[lane] = (static_cast<float>(lane) + 0.5f) / kLanes;
    }
    LightSampleLanes samples;
    lights.sample({active, p, n, n, p}, u, learnt, samples, groups);
    // Half of the samples are shared evenly by two.
    EXPECT_EQ(std::count(groups.begin(), groups.end(), 1), kLanes / 4) << lampIsKnown;
  }
}

TEST(PunctualLights, ManyDegenerate) {
  Light light;
  light.position = {0, 1, 0};
  const Vec3 up(0, 1, 0);
  const PunctualLights pile(std::vector<Light>(1000, light));
  EXPECT_NEAR(sampleOne(pile, {0, 0, 0}, up, 0.3f).weight.x, 1000.0f, 0.1f);
  // At the very place of all lights, and with all of them behind: nothing, and no NaN.
  EXPECT_EQ(sampleOne(pile, {0, 1, 0}, up, 0.3f).weight, Vec3(0.0f));
  EXPECT_EQ(sampleOne(pile, {0, 2, 0}, up, 0.3f).weight, Vec3(0.0f));
  std::vector<Light> suns(100, light);
  for (Light& sun : suns) {
    sun.type = LightType::Directional;
    sun.direction = {0, -1, 0};
  }
  EXPECT_NEAR(sampleOne(PunctualLights(suns), {0, 0, 0}, up, 0.7f).weight.x, 100.0f, 0.01f);
  EXPECT_EQ(sampleOne(PunctualLights(suns), {0, 0, 0}, up, 0.7f, true).weight, Vec3(0.0f));
}

/// Many lamps in view of each other, none in the way of another as seen from the floor.
struct Lamps {
  TestScene test;
  std::vector<std::string> notes;
  std::unique_ptr<Materials> materials;
  std::unique_ptr<RayScene> rays;
  EmissiveTriangles lights;

  explicit Lamps(int side, float width) {
    const int bright = test.addMaterial(Vec3(0.5f), Vec3(4.0f));
    const int dim = test.addMaterial(Vec3(0.5f), Vec3(1.0f));
    for (int i = 0; i < side; ++i)
      for (int j = 0; j < side; ++j)
        test.addRectangle({static_cast<float>(i) - 0.5f * width, 1.0f, static_cast<float>(j) - 0.5f * width},
                          {width, 0, 0}, {0, 0, width}, {.material = (i + j) % 5 ? dim : bright, .texels = 0});
    materials = std::make_unique<Materials>(test.scene, true, notes);
    rays = std::move(*RayScene::build(test.scene, *materials));
    lights = EmissiveTriangles(*rays, *materials);
  }
};

TEST(EmissiveTriangles, ManyAgreeWithClosedForms) {
  for (const auto& [side, width] : {std::pair{1, 3.0f}, std::pair{3, 0.9f}, std::pair{20, 0.3f}}) {
    const Lamps lamps(side, width);
    ASSERT_EQ(lamps.lights.size(), static_cast<std::size_t>(2 * side * side));
    for (const Vec3& p : {Vec3(0.1f, 0, 0.2f), Vec3(0.7f, 0.95f, 1.1f), Vec3(-4, 0.5f, 1)}) {
      double truth = 0;
      for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
          const double x = i, z = j, h = 0.5 * static_cast<double>(width);
          truth += ((i + j) % 5 ? 1.0 : 4.0) *
                   polygonLight(Vec3d(p), {0, 1, 0}, {0, 1, 0},
                                {{x - h, 1, z - h}, {x + h, 1, z - h}, {x + h, 1, z + h}, {x - h, 1, z + h}});
        }
      constexpr std::uint32_t kSamples = 1 << 17;
      double sum = 0;
      for (std::uint32_t i = 0; i < kSamples; ++i) {
        const LightSample s = sampleOne(lamps.lights, p, sobol1D(i, 1), sobol2D(i, 2));
        sum += static_cast<double>(s.weight.x * std::max(0.0f, s.wi.y)) / std::numbers::pi / kSamples;
      }
      EXPECT_NEAR(sum / truth, 1.0, 5e-3) << side << " lamps on a side";  // noise: 2e-3 and less
    }
  }
}

// Over all directions: every hit's density once, 1 in all. Where a lamp is so near that it fills half of the view,
// and where all are small.
TEST(EmissiveTriangles, DensityIntegratesToOne) {
  for (const auto& [side, width] : {std::pair{1, 3.0f}, std::pair{3, 0.9f}, std::pair{6, 0.3f}}) {
    const Lamps lamps(side, width);
    for (const Vec3& p : {Vec3(0.1f, 0, 0.2f), Vec3(0.7f, 0.8f, 1.1f)}) {
      constexpr std::uint32_t kRays = 1 << 18;
      double sum = 0;
      for (std::uint32_t first = 0; first < kRays; first += kLanes) {
        RayPacket packet;
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
          const Vec2 u = sobol2D(first + lane, 5);
          const float r = std::sqrt(1.0f - u.x * u.x);
          const float phi = 2 * kPi * u.y;
          packet.set(static_cast<int>(lane), p, {r * std::cos(phi), u.x, r * std::sin(phi)});
        }
        lamps.rays->intersect(packet, TraceMode::Packet);
        for (int lane = 0; lane < kLanes; ++lane)
          if (packet.hit(lane)) sum += static_cast<double>(lamps.lights.pdf(lamps.rays->surfaceAt(packet, lane), p));
      }
      // Uniform over the upper hemisphere; noise of the small lamps' edges.
      EXPECT_NEAR(sum * 2 * std::numbers::pi / kRays, 1.0, 0.01) << side << " lamps on a side";
    }
  }
}

}  // namespace
}  // namespace lumel
