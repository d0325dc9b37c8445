// Lamps that are more than a point against closed forms, in both integrators; modes and shadow masks.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "baker/bake/shadow_masks.h"
#include "baker/light/light_shapes.h"
#include "baker/light/lit_scene.h"
#include "lightmap/texels/texels.h"
#include "scene/ies/ies_file.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr double kPiD = std::numbers::pi;
constexpr std::array kIntegrators = {Integrator::Path, Integrator::Gather};

struct Ground {
  TestScene test;
  int page = 0;
  std::array<Vec3d, 4> axes;  // normal, B0, B1, B2

  explicit Ground(int texels = 4) {
    page = test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.texels = texels});
    for (int i = 0; i < 4; ++i) axes[static_cast<std::size_t>(i)] = axisInWorld(test, page, i - 1);
  }
  Maps fromDirection(const Vec3d& wi, double facing) const {
    Maps m{};
    for (std::size_t i = 0; i < 4; ++i) m[i] = facing / kPiD * std::max(0.0, glm::dot(wi, axes[i]));
    return m;
  }
  Maps fromPolygon(const Vec3d& p, double radiance, const std::vector<Vec3d>& corners) const {
    Maps m{};
    for (std::size_t i = 0; i < 4; ++i) m[i] = radiance * polygonLight(p, axes[0], axes[i], corners);
    return m;
  }
  /// Both integrators agree with a closed form.
  void expect(const std::function<Maps(const Vec3d&)>& form, BakeOptions options = {.samples = 64, .bounces = 0}) {
    for (const Integrator integrator : kIntegrators) {
      SCOPED_TRACE(nameOf(integrator));
      test.integrator = integrator;
      expectAgreement(deviation(test, options, page, form));
    }
  }
};

Light panel(LightType type, const Vec3& position, float nits) {
  Light light;
  light.type = type;
  light.position = position;
  light.direction = {0, -1, 0};
  light.right = {1, 0, 0};
  light.up = {0, 0, -1};
  light.intensity = nits;
  return light;
}

std::vector<Vec3d> cornersOf(const Light& light) {
  const Vec3d c(light.position), x = 0.5 * static_cast<double>(light.size.x) * Vec3d(light.right),
                                 y = 0.5 * static_cast<double>(light.size.y) * Vec3d(light.up);
  return {c - x - y, c + x - y, c + x + y, c - x + y};
}

// The form factor of a rectangle, at a distance of its own size and close to the floor.
TEST(AreaLights, RectangleOverAFloor) {
  for (const float height : {1.2f, 0.15f}) {
    Ground ground(8);
    Light light = panel(LightType::Rectangle, {0.3f, height, -0.2f}, 3.0f);
    light.size = {0.8f, 0.5f};
    ground.test.scene.lights = {light};
    ground.expect([&](const Vec3d& p) { return ground.fromPolygon(p, 3.0, cornersOf(light)); });
  }
}

// A panel that stands upright and is cut by the horizon of the floor gives what is above.
TEST(AreaLights, RectangleThroughTheHorizon) {
  Ground ground(8);
  Light light = panel(LightType::Rectangle, {-1.5f, 0.1f, 0.1f}, 5.0f);
  light.size = {1.0f, 1.0f};
  light.direction = {1, 0, 0};
  light.right = {0, 0, 1};
  light.up = {0, 1, 0};
  ground.test.scene.lights = {light};
  ground.expect([&](const Vec3d& p) { return ground.fromPolygon(p, 5.0, cornersOf(light)); });
}

TEST(AreaLights, PanelsShineToTheirFrontAlone) {
  Ground ground;
  Light light = panel(LightType::Rectangle, {0, 1, 0}, 3.0f);
  light.size = {1, 1};
  light.direction = {0, 1, 0};
  Light disc = light;
  disc.type = LightType::Disc;
  disc.radius = 0.5f;
  ground.test.scene.lights = {light, disc};
  for (const Integrator integrator : kIntegrators) {
    ground.test.integrator = integrator;
    EXPECT_EQ(ground.test.bake({.samples = 16, .bounces = 0}).stats.meanFlat, 0.0);
  }
}

// On its axis a disc brings pi L r^2 / (r^2 + h^2); elsewhere it is a polygon of many corners, whose missing area is
// 2 pi^2 / (3 n^2), 2.5e-5 of it.
TEST(AreaLights, DiscOverAFloor) {
  constexpr int kCorners = 512;
  for (const float height : {1.5f, 0.2f}) {
    Ground ground;
    Light light = panel(LightType::Disc, {0.2f, height, 0.1f}, 2.0f);
    light.radius = 0.4f;
    ground.test.scene.lights = {light};
    std::vector<Vec3d> corners;
    for (int i = 0; i < kCorners; ++i) {
      const double turn = 2 * kPiD * i / kCorners, r = static_cast<double>(light.radius);
      corners.push_back(Vec3d(light.position) + Vec3d(r * std::cos(turn), 0, r * std::sin(turn)));
    }
    const double h2 = static_cast<double>(height) * static_cast<double>(height), r2 = 0.16;
    EXPECT_NEAR(polygonLight(Vec3d(light.position.x, 0, light.position.z), {0, 1, 0}, {0, 1, 0}, corners),
                r2 / (r2 + h2), 3e-5);
    ground.expect([&](const Vec3d& p) { return ground.fromPolygon(p, 2.0, corners); }, {.samples = 256, .bounces = 0});
  }
}

// A sphere above the horizon brings what a point of its intensity does: pi L (r / d)^2 = I / d^2.
TEST(AreaLights, SphereBringsWhatAPointDoes) {
  for (const LightType type : {LightType::Sphere, LightType::Point}) {
    Ground ground;
    Light light;
    light.type = type;
    light.position = {0.2f, 4.0f, -0.3f};
    light.intensity = 7.0f;
    light.radius = 0.3f;
    ground.test.scene.lights = {light};
    ground.expect([&](const Vec3d& p) {
      const Vec3d d = Vec3d(light.position) - p;
      return ground.fromDirection(glm::normalize(d), 7.0 / glm::dot(d, d));
    });
  }
}

// The floor cuts a soft lamp: a point at height z < r inside of the sphere is lit by its shell from all around, pi L.
TEST(AreaLights, InsideOfASphere) {
  Light light;
  light.radius = 0.5f;
  light.intensity = kPi * 0.25f;  // radiance 1
  const LightShape shape(light);
  const std::array<Vec3, 2> places = {Vec3(0.1f, -0.2f, 0.05f), Vec3(0.0f, -0.50001f, 0.0f)};
  for (std::size_t i = 0; i < places.size(); ++i) {
    double sum = 0.0;
    constexpr int kSamples = 1 << 14;
    const TexelSampler sampler(1, 0, 0, 0);
    for (int s = 0; s < kSamples; ++s) {
      const LightShape::Sample sample = shape.sample(places[i], sampler.get2D(static_cast<std::uint32_t>(s), 0));
      sum += static_cast<double>(sample.weight.x * std::max(0.0f, sample.wi.y)) / kSamples;
      EXPECT_NEAR(glm::length(sample.target), 0.5f, 1e-3f);
    }
    // Sobol points of a smooth function: the error is far below a thousandth. Just outside r/d = 1 - 2e-5 is missing
    // to a hemisphere, of which the cone lacks a share of its root.
    EXPECT_NEAR(sum / kPiD, 1.0, i == 0 ? 1e-3 : 1e-2);
  }
}

/// Solid angle of a rectangle at y = 0 as a point at height h above the origin sees it.
double solidAngleBelow(double x0, double x1, double z0, double z1, double h) {
  const auto corner = [&](double x, double z) { return std::atan2(x * z, h * std::sqrt(x * x + z * z + h * h)); };
  return corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0);
}

// Small lamps a hundredth of a texel above it keep their light (NearLight).
TEST(AreaLights, SmallSpheresCloseToATexel) {
  Ground ground;
  Light light;
  light.type = LightType::Sphere;
  light.position = {0.21f, 0.008f, 0.3f};
  light.intensity = 2.0f;
  light.radius = 0.004f;
  ground.test.scene.lights = {light};
  for (const Integrator integrator : kIntegrators) {
    ground.test.integrator = integrator;
    const BakeResult result = ground.test.bake({.samples = 256, .bounces = 0});
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x) {
        const double x0 = -1 + 0.5 * x - 0.21, z0 = -1 + 0.5 * y - 0.3;
        const double want = 2.0 * solidAngleBelow(x0, x0 + 0.5, z0, z0 + 0.5, 0.008) / 0.25 / kPiD;
        const auto got = static_cast<double>(result.pages[static_cast<std::size_t>(ground.page)].flat.rgb(x, y).x);
        // 256 samples; within reach the split leaves a spread of about the half of a texel's light.
        EXPECT_NEAR(got / want, 1.0, 0.03) << x << ' ' << y;
      }
  }
}

/// Irradiance / pi of a sun of half angle s about the zenith that `blocks` hides where it says so, by a grid of its
/// disc.
Maps fromSun(const Ground& ground, double facing, double halfAngle, const std::function<bool(const Vec3d&)>& blocks) {
  constexpr int kGrid = 64;
  Maps m{};
  int inside = 0;
  for (int j = 0; j < kGrid; ++j)
    for (int i = 0; i < kGrid; ++i) {
      const double x = (2 * i + 1.0) / kGrid - 1, z = (2 * j + 1.0) / kGrid - 1;
      if (x * x + z * z > 1) continue;
      ++inside;
      const double s = std::sin(halfAngle);
      const Vec3d wi(s * x, std::sqrt(1 - s * s * (x * x + z * z)), s * z);
      if (blocks(wi)) continue;
      for (std::size_t k = 0; k < 4; ++k) m[k] += facing / kPiD / wi.y * std::max(0.0, glm::dot(wi, ground.axes[k]));
    }
  for (double& v : m) v /= inside;
  return m;
}

TEST(AreaLights, SunOfAnAngleOverAnEdge) {
  Ground ground(8);
  ground.test.addRectangle({-4, 0.5f, 4}, {4, 0, 0}, {0, 0, -8}, {.texels = 0});  // hides the sky over x < 0
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.intensity = 3.0f;
  sun.halfAngle = 0.5f;
  ground.test.scene.lights = {sun};
  for (const Integrator integrator : kIntegrators) {
    ground.test.integrator = integrator;
    const BakeResult result = ground.test.bake({.samples = 1024, .bounces = 0});
    const Image& flat = result.pages[static_cast<std::size_t>(ground.page)].flat;
    for (int x = 0; x < 8; ++x) {
      double want = 0.0;
      constexpr int kSteps = 32;
      for (int i = 0; i < kSteps; ++i) {
        const double at = -1 + 0.25 * (x + (i + 0.5) / kSteps);
        want += fromSun(ground, 3.0, 0.5, [&](const Vec3d& wi) { return at + 0.5 * wi.x / wi.y < 0; })[0] / kSteps;
      }
      // The penumbra is 0.55 m wide; 1024 samples across an edge are within 1.5% of full light.
      EXPECT_NEAR(static_cast<double>(flat.rgb(x, 4).x), want, 0.015 * 3.0 / kPiD) << x;
    }
  }
}

// Seen whole, it brings its lux to a facing surface, whatever its angle.
TEST(AreaLights, SunOfAnAngleKeepsItsLux) {
  Ground ground;
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.intensity = 3.0f;
  sun.halfAngle = 0.3f;
  ground.test.scene.lights = {sun};
  for (const Integrator integrator : kIntegrators) {
    ground.test.integrator = integrator;
    const BakeResult result = ground.test.bake({.samples = 64, .bounces = 0});
    // cosTheta = cos a there, so that the weight E / cos a gives every sample the same.
    EXPECT_NEAR(result.stats.meanFlat, 3.0 / kPiD, 1e-5);
  }
}

constexpr const char* kProfile =
    "IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] none\nTILT=NONE\n1 1000 2 4 1 1 2 0 0 0\n1 1 50\n0 30 60 90\n0\n"
    "100 80 20 0\n";

// Irradiance follows the table: candela by the angle from straight down, linear in between.
TEST(AreaLights, ProfileAgainstItsTable) {
  const auto profile = parseIes(kProfile);
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->mostCandela, 200.0f);
  Ground ground(8);
  Light light;
  light.position = {0.1f, 1.0f, -0.2f};
  light.direction = {0, -1, 0};
  light.right = {1, 0, 0};
  light.up = {0, 0, -1};
  light.intensity = profile->mostCandela;
  light.profile = std::make_shared<const LightProfile>(*profile);
  ground.test.scene.lights = {light};
  ground.expect([&](const Vec3d& p) {
    const Vec3d d = Vec3d(light.position) - p;
    const double angle = std::acos(d.y / glm::length(d)) * 180 / kPiD;
    constexpr std::array kCandela = {200.0, 160.0, 40.0, 0.0};
    const auto lower = static_cast<std::size_t>(angle / 30);
    const double share = angle / 30 - static_cast<double>(lower);
    const double candela = kCandela[lower] + share * (kCandela[lower + 1] - kCandela[lower]);
    return ground.fromDirection(glm::normalize(d), candela / glm::dot(d, d));
  });
}

// Enough lamps for the tree: the light is that of all.
TEST(AreaLights, ManyPanels) {
  Ground ground;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (int i = 0; i < 40; ++i) {
    Light light = panel(LightType::Rectangle, {4 * unit(random) - 2, 0.5f + unit(random), 4 * unit(random) - 2},
                        0.2f + unit(random));
    light.size = {0.1f + 0.3f * unit(random), 0.1f + 0.3f * unit(random)};
    ground.test.scene.lights.push_back(light);
  }
  ground.expect(
      [&](const Vec3d& p) {
        Maps sum{};
        for (const Light& light : ground.test.scene.lights) {
          const Maps one = ground.fromPolygon(p, static_cast<double>(light.intensity), cornersOf(light));
          for (std::size_t k = 0; k < 4; ++k) sum[k] += one[k];
        }
        return sum;
      },
      {.samples = 256, .bounces = 0});
}

// What a sample brings is bounded by the radiance, however close the point, and no lamp that brings light is left out
// of the choice.
TEST(AreaLights, WeightsAreBoundedAndChoicesPossible) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (const LightType type :
       {LightType::Rectangle, LightType::Disc, LightType::Sphere, LightType::Spot, LightType::Directional}) {
    Light light = panel(type, {0, 0, 0}, 1.0f);
    light.size = {1.0f, 0.3f};
    light.radius = type == LightType::Directional ? 0.0f : 0.4f;
    light.halfAngle = type == LightType::Directional ? 0.2f : 0.0f;
    light.outerConeAngle = 0.6f;
    const LightShape shape(light);
    const float radiance = isPanel(type) ? 1.0f : type == LightType::Directional ? 1.0f : 1.0f / (kPi * 0.16f);
    float most = 0.0f;
    for (int i = 0; i < 20000; ++i) {
      const float near = std::pow(10.0f, -5.0f * unit(random));
      const Vec3 p((unit(random) - 0.5f) * 2, -near * 2, (unit(random) - 0.5f) * 2);
      const Vec3 n = glm::normalize(Vec3(unit(random) - 0.5f, unit(random) - 0.3f, unit(random) - 0.5f));
      const LightShape::Sample sample = shape.sample(p, {unit(random), unit(random)});
      ASSERT_TRUE(isFinite(sample.weight));
      most = std::max(most, sample.weight.x);
      const bool brings = sample.weight.x > 0.0f && glm::dot(sample.wi, n) > 0.0f;
      ASSERT_TRUE(!brings || shape.importance(p, n) > 0.0f) << nameOf(type);
    }
    // A sphere fills 4 pi from inside, a panel 2 pi; discs far off are sampled by area, with up to pi; of a sun E /
    // cos.
    EXPECT_LE(most, radiance * 4.0f * kPi * 1.0001f) << nameOf(type);
    EXPECT_GT(most, 0.0f) << nameOf(type);
  }
}

TestScene litRoom(LightMode mode) {
  TestScene test;
  test.scene.materials[0].baseColor = {0.5f, 0.5f, 0.5f, 1.0f};
  test.addRoom({-1, 0, -1}, {1, 2, 1});
  Light lamp = panel(LightType::Rectangle, {0, 1.9f, 0}, 4.0f);
  lamp.size = {0.5f, 0.5f};
  lamp.mode = mode;
  Light point;
  point.position = {0.5f, 1, 0.5f};
  point.mode = LightMode::None;
  test.scene.lights = {lamp, point};
  return test;
}

TEST(LightModes, IndirectIsAllWithoutWhatComesStraight) {
  for (const Integrator integrator : kIntegrators) {
    SCOPED_TRACE(nameOf(integrator));
    const auto meanOf = [&](LightMode mode, int bounces) {
      TestScene test = litRoom(mode);
      test.integrator = integrator;
      return test.bake({.samples = 256, .bounces = bounces}).stats.meanFlat;
    };
    const double straight = meanOf(LightMode::All, 0), all = meanOf(LightMode::All, 3);
    EXPECT_EQ(meanOf(LightMode::Indirect, 0), 0.0);
    EXPECT_EQ(meanOf(LightMode::None, 3), 0.0);
    // Means over 96 texels of 256 samples each.
    EXPECT_NEAR(meanOf(LightMode::Indirect, 3) / (all - straight), 1.0, 0.01);
    EXPECT_GT(straight, 0.0);
  }
}

TEST(ShadowMasks, SeeWhatStandsBetween) {
  Ground ground(16);
  ground.test.addRectangle({-4, 0.5f, 4}, {4, 0, 0}, {0, 0, -8}, {.texels = 0});  // over x < 0
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.hasShadowMask = true;
  sun.mode = LightMode::Indirect;
  Light plain = sun;
  plain.hasShadowMask = false;
  Light spot;  // its cone does not reach the ground, which plays no part
  spot.type = LightType::Spot;
  spot.position = {0, 0.25f, 0};
  spot.direction = {0, 1, 0};
  spot.hasShadowMask = true;
  spot.mode = LightMode::None;
  Light below = panel(LightType::Rectangle, {0, -1, 0}, 1.0f);
  below.size = {1, 1};
  below.hasShadowMask = true;
  ground.test.scene.lights = {plain, sun, spot, below};
  EXPECT_EQ(lightsWithMask(ground.test.scene.lights), (std::vector<std::size_t>{1, 2, 3}));
  const auto lit = LitScene::build(ground.test.scene, false);
  ASSERT_TRUE(lit);
  const auto texels = findTexels(ground.test.atlas);
  const BakeResult result = ground.test.bake({.samples = 16, .bounces = 0});
  Progress progress;
  const auto masks =
      bakeShadowMasks(**lit, ground.test.scene.lights, ground.test.atlas, texels, result.pages, {}, progress);
  ASSERT_TRUE(masks);
  const Image& mask = (*masks)[static_cast<std::size_t>(ground.page)];
  for (int x = 0; x < 16; ++x) {
    EXPECT_EQ(mask.at(x, 8)[0], x < 8 ? 0.0f : 1.0f) << x;
    EXPECT_EQ(mask.at(x, 8)[1], 1.0f) << x;
    EXPECT_EQ(mask.at(x, 8)[2], 0.0f) << x;
    EXPECT_EQ(mask.at(x, 8)[3], 0.0f) << x;
  }
}

}  // namespace
}  // namespace lumel
