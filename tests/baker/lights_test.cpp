// Densities of light sampling: what sample() states must be what pdf() answers for the same direction.
#include <gtest/gtest.h>

#include <limits>

#include "baker/light/emissive_triangles.h"
#include "baker/light/environment_light.h"
#include "baker/light/punctual_lights.h"
#include "baker/rays/sampling.h"
#include "scene/base/sobol.h"
#include "scene/images/environment.h"
#include "tests/baker/one_sample.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

TEST(EmissiveTriangles, DensityOfAHitIsThatOfTheSample) {
  TestScene test;
  const int plain = test.addMaterial(Vec3(0.5f), Vec3(2.0f));
  const int textured = test.addMaterial(Vec3(0.5f), Vec3(3.0f));
  Material& m = test.scene.materials[static_cast<std::size_t>(textured)];
  m.emissionMap.image = test.addImage(2, 1, {{0.2f, 0.2f, 0.2f, 1}, {1, 1, 1, 1}});
  m.doubleSided = true;
  test.addRectangle({-2, 3, -1}, {1, 0, 0}, {0, 0.2f, 1}, {.material = plain, .flip = true});
  test.addRectangle({1, 2, -1}, {0.5f, 0.3f, 0}, {0, 0, -2}, {.material = textured});
  Mat4 moved(Vec4(0, 1, 0, 0), Vec4(-1, 0, 0, 0), Vec4(0, 0, 0.5f, 0), Vec4(0, 3, 3, 1));
  test.addInstance(1, moved);
  std::vector<std::string> notes;
  const Materials materials(test.scene, true, notes);
  auto rays = RayScene::build(test.scene, materials, 0);
  ASSERT_TRUE(rays);
  const EmissiveTriangles lights(**rays, materials);
  EXPECT_EQ(lights.size(), 6u);
  const Vec3 p(0.1f, 0, 0.2f);
  int met = 0;
  double flux = 0;
  constexpr std::uint32_t kSamples = 4096;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const LightSample s = sampleOne(lights, p, sobol1D(i, 1), sobol2D(i, 2));
    if (s.weight == Vec3(0.0f)) continue;
    RayPacket packet;
    packet.set(0, p, s.wi);
    (*rays)->intersect(packet, TraceMode::Packet);
    ASSERT_TRUE(packet.hit(0));
    const HitSurface hit = (*rays)->surfaceAt(packet, 0);
    // Another lamp may be in the way; a sample within rounding of an edge may be hit on the other triangle.
    if (glm::distance(hit.p, s.target) > 1e-3f) continue;
    ++met;
    EXPECT_NEAR(lights.pdf(hit, p) / s.pdf, 1.0f, 2e-3f);
    EXPECT_LT(glm::distance(emittedTowardsRay(materials, hit), s.weight * s.pdf), 2e-3f);
    flux += static_cast<double>(s.weight.x) / kSamples;
  }
  EXPECT_GT(met, 2000);
  EXPECT_GT(flux, 0.1);
}

TEST(EmissiveTriangles, NoneWithoutEmission) {
  TestScene test;
  const int unlit = test.addMaterial(Vec3(0.5f), Vec3(1.0f));
  test.scene.materials[static_cast<std::size_t>(unlit)].unlit = true;
  test.addRectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {.material = unlit});
  test.addRectangle({-1, 2, -1}, {2, 0, 0}, {0, 0, 2},
                    {.material = test.addMaterial(Vec3(1.0f), Vec3(1.0f)), .casts = false});
  std::vector<std::string> notes;
  const Materials materials(test.scene, true, notes);
  auto rays = RayScene::build(test.scene, materials);
  ASSERT_TRUE(rays);
  EXPECT_TRUE(EmissiveTriangles(**rays, materials).empty());
}

Environment patchySky() {
  Environment sky;
  sky.image = Image(32, 16, 3, 0.1f);
  sky.image.setRgb(5, 0, Vec3(300.0f));  // a sun at the zenith, where cells are thinnest
  sky.image.setRgb(31, 7, {20, 10, 5});  // bleeds round the seam
  sky.image.setRgb(12, 15, Vec3(7.0f));
  for (int x = 0; x < 32; ++x) sky.image.setRgb(x, 11, Vec3(0.0f));
  sky.rotationDegrees = 77.0f;
  return sky;
}

/// Integrals over the sphere of a part's density and of its light, by midpoints.
struct SkyIntegral {
  double density = 0;
  double light = 0;
};
SkyIntegral integrate(const Environment& sky, const EnvironmentLight& light) {
  SkyIntegral sum;
  constexpr int kRows = 1024, kColumns = 2048;
  const double cell = std::numbers::pi / kRows * 2 * std::numbers::pi / kColumns;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const double polar = std::numbers::pi * (row + 0.5) / kRows,
                   azimuth = 2 * std::numbers::pi * (column + 0.5) / kColumns;
      const Vec3 w(static_cast<float>(std::sin(polar) * std::cos(azimuth)), static_cast<float>(std::cos(polar)),
                   static_cast<float>(std::sin(polar) * std::sin(azimuth)));
      sum.density += static_cast<double>(light.pdf(w)) * std::sin(polar) * cell;
      sum.light += static_cast<double>(luminance(environmentRadiance(sky, w))) * std::sin(polar) * cell;
    }
  return sum;
}

/// Light that kSamples samples find; their densities are those that pdf() answers.
double sampled(const EnvironmentLight& light, bool sun) {
  int same = 0;
  constexpr std::uint32_t kSamples = 8192;
  double mean = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const LightSample s = sampleOne(light, sun, sobol2D(i, 1));
    EXPECT_NEAR(glm::length(s.wi), 1.0f, 1e-5f);
    // A direction within rounding of a cell's border may fall into the next one.
    same += std::abs(light.pdf(s.wi) / s.pdf - 1.0f) < 1e-4f;
    mean += static_cast<double>(luminance(s.weight)) / kSamples;
  }
  EXPECT_GE(same, static_cast<int>(0.998 * kSamples));
  return mean;
}

TEST(EnvironmentLight, DensitiesRoundTripAndIntegrateToOne) {
  const Environment sky = patchySky();
  const EnvironmentLight light(sky);
  ASSERT_TRUE(light.skySampled() && light.sunSampled());
  const SkyIntegral whole = integrate(sky, light);
  // Midpoints against borders of cells turned by 77 degrees: 1e-3 each.
  EXPECT_NEAR(whole.density, 2.0, 4e-3);
  // 8192 stratified samples of a weight that varies within cells.
  EXPECT_NEAR((sampled(light, false) + sampled(light, true)) / whole.light, 1.0, 3e-3);
}

TEST(EnvironmentLight, EvenSkiesHaveNoSun) {
  Environment sky = patchySky();
  sky.image.setRgb(5, 0, Vec3(0.1f));
  sky.image.setRgb(31, 7, Vec3(0.1f));
  sky.image.setRgb(12, 15, Vec3(0.1f));
  const EnvironmentLight even(sky);
  EXPECT_FALSE(even.sunSampled());
  const SkyIntegral whole = integrate(sky, even);
  EXPECT_NEAR(whole.density, 1.0, 2e-3);
  EXPECT_NEAR(sampled(even, false) / whole.light, 1.0, 3e-3);
}

// One texel of a sky of 4096 x 2048, a tenth of a degree wide, shines like the sun and nothing else does: all samples
// find it, and rays that hit it by chance count next to nothing. Bilinear lookup makes it three texels wide.
TEST(EnvironmentLight, OneBrightTexelOfALargeBlackSky) {
  Environment sky;
  sky.image = Image(4096, 2048, 3, 0.0f);
  sky.image.setRgb(1000, 700, Vec3(1e6f));
  const EnvironmentLight light(sky);
  ASSERT_TRUE(light.sunSampled());
  const double step = std::numbers::pi / 2048;
  // The texel's light is its luminance times its solid angle: the interpolant's weights sum to one, but for the sine's
  // curvature.
  const double flux = 1e6 * step * step * std::sin(step * 700.5);
  EXPECT_NEAR(sampled(light, true) / flux, 1.0, 3e-3);
  EXPECT_FALSE(light.skySampled());
  EXPECT_EQ(light.pdf({0, 1, 0}), 0.0f);
}

// The cells hold the light of the image's interpolant however they divide its pixels or join them: of a sky of few
// pixels each point is met nearly as it is, of a fine one the mean.
TEST(EnvironmentLight, CellsKeepTheLightOfAnyImage) {
  for (const int width : {1, 3, 100, 700, 5000}) {
    Environment sky;
    sky.image = Image(width, std::max(1, width / 2), 3);
    for (int y = 0; y < sky.image.height; ++y)
      for (int x = 0; x < width; ++x)
        sky.image.setRgb(x, y,
                         Vec3(unitFloat(hashCombine(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)))));
    sky.strength = 3.0f;
    const EnvironmentLight light(sky);
    const double found =
        (light.skySampled() ? sampled(light, false) : 0.0) + (light.sunSampled() ? sampled(light, true) : 0.0);
    EXPECT_NEAR(found / integrate(sky, light).light, 1.0, 3e-3) << width;
    if (width > 100) continue;
    // Less than half a cell beside a place a bilinear interpolant of values below 3 differs by 3 / (pixels per cell).
    for (std::uint32_t i = 0; i < 256; ++i) {
      const Vec3 w = directionFromZ(2.0f * sobol2D(i, 5).x - 1.0f, sobol2D(i, 5).y);
      EXPECT_NEAR(light.radiance(w).x, environmentRadiance(sky, w).x, 3.0f * static_cast<float>(width) / 512) << width;
    }
  }
}

TEST(EnvironmentLight, LanesDoNotDependOnEachOther) {
  const Environment sky = patchySky();
  const EnvironmentLight light(sky);
  for (std::uint32_t i = 0; i < 256; ++i) {
    UnitSquareLanes u;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec2 point = sobol2D(i * kLanes + static_cast<std::uint32_t>(lane), 9);
      u.x[lane] = point.x;
      u.y[lane] = point.y;
    }
    for (const bool sun : {true, false}) {
      LightSampleLanes samples;
      sun ? light.sampleSun(u, samples) : light.sampleSky(u, samples);
      alignas(64) float gathered[kLanes];
      for (std::size_t lane = 0; lane < kLanes; ++lane) gathered[lane] = 0.1f * static_cast<float>(lane + 1);
      Vec3Lanes arriving;
      light.arriving(samples.wi, gathered, arriving);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const Vec2 point(u.x[lane], u.y[lane]);
        const LightSample one = sampleOne(light, sun, point);
        EXPECT_EQ(samples.wi[lane], one.wi);
        EXPECT_EQ(samples.weight[lane], one.weight);
        EXPECT_EQ(samples.pdf[lane], one.pdf);
        EXPECT_EQ(arriving[lane], light.arriving(one.wi, gathered[lane]));
        EXPECT_EQ(arriving[lane], light.radiance(one.wi) * misWeight(gathered[lane], light.pdf(one.wi)));
      }
    }
  }
}

TEST(EnvironmentLight, NothingIsBuiltWithoutAnImage) {
  const EnvironmentLight black((Environment()));
  EXPECT_FALSE(black.shines());
  Environment constant;
  constant.color = Vec3(1.0f);
  const EnvironmentLight sky(constant);
  EXPECT_TRUE(sky.shines());
  EXPECT_FALSE(sky.sampled());
  EXPECT_FALSE(black.sampled());
  EXPECT_EQ(sky.pdf({0, 1, 0}), 0.0f);
  constant.strength = 0.0f;
  EXPECT_FALSE(EnvironmentLight(constant).shines());
}

// For few lights and for a tree of them, with and without the directional ones.
TEST(PunctualLights, LanesDoNotDependOnEachOther) {
  for (const std::size_t count : {5u, 60u}) {
    std::vector<Light> some(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec2 place = sobol2D(static_cast<std::uint32_t>(i), 1);
      some[i].type = i < 2 ? LightType::Directional : i % 2 ? LightType::Spot : LightType::Point;
      some[i].position = {4.0f * place.x, 1.0f + place.y, 4.0f * place.y};
      some[i].direction = glm::normalize(Vec3(place.x - 0.5f, -1.0f, place.y - 0.5f));
      some[i].range = i % 3 == 0 ? 3.0f : 0.0f;
    }
    const PunctualLights lights(some);
    for (std::uint32_t trial = 0; trial < 64; ++trial) {
      LaneFlags active;
      Vec3Lanes p, n;
      UnitLanes u;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto number = trial * kLanes + static_cast<std::uint32_t>(lane);
        const Vec2 place = sobol2D(number, 2);
        active[lane] = 1;
        p.set(lane, {4.0f * place.x, 0.0f, 4.0f * place.y});
        n.set(lane, directionFromZ(2.0f * sobol2D(number, 3).x - 1.0f, sobol2D(number, 3).y));
        u.u[lane] = sobol1D(number, 4);
      }
      const ReceiverLanes at{active, p, n, n, p};
      for (const bool near : {false, true}) {
        LightSampleLanes samples;
        near ? lights.sampleNear(at, u, samples) : lights.sample(at, u, samples);
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const LightSample one = sampleOne(lights, p[lane], n[lane], u.u[lane], near);
          EXPECT_EQ(samples.weight[lane], one.weight);
          if (one.weight == Vec3(0.0f)) continue;
          EXPECT_EQ(samples.wi[lane], one.wi);
          EXPECT_EQ(samples.distant[lane] != 0, one.distant);
          if (!one.distant) {
            EXPECT_EQ(samples.target[lane], one.target);
          }
        }
      }
    }
  }
}

TEST(PunctualLights, ChoiceIsProportionalToWhatArrives) {
  Light near, far, behind;
  near.position = {0, 1, 0};
  far.position = {0, 3, 0};
  behind.position = {0, -1, 0};
  behind.intensity = 100.0f;
  const PunctualLights lights({behind, near, far});
  // Both have the same direction: with u below the near one's share (1 / (1 + 1/9)) it is chosen, and the weight is the
  // sum of both irradiances either way.
  for (const float u : {0.0f, 0.5f, 0.89f, 0.91f, 0.999999f}) {
    const LightSample s = sampleOne(lights, {0, 0, 0}, {0, 1, 0}, u);
    EXPECT_EQ(s.target.y, u < 0.9f ? 1.0f : 3.0f);
    EXPECT_NEAR(s.weight.x, 1.0f + 1.0f / 9, 1e-5f);
    EXPECT_EQ(s.pdf, 0.0f);
  }
  EXPECT_EQ(PunctualLights(std::vector<Light>{}).size(), 0u);
  Light off;
  off.intensity = 0.0f;
  EXPECT_TRUE(PunctualLights({off}).empty());
}

}  // namespace
}  // namespace lumel
