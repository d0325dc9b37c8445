// Direct light on a rectangle against closed forms, flat and all three raw RNM maps.
#include <gtest/gtest.h>

#include "scene/images/environment.h"
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
  /// Light of irradiance `facing` on a facing surface from direction wi.
  Maps fromDirection(const Vec3d& wi, double facing) const {
    Maps m{};
    for (std::size_t i = 0; i < 4; ++i) m[i] = facing / kPiD * std::max(0.0, glm::dot(wi, axes[i]));
    return m;
  }
  Maps fromPolygon(const Vec3d& p, const std::vector<Vec3d>& corners) const {
    Maps m{};
    for (std::size_t i = 0; i < 4; ++i) m[i] = polygonLight(p, axes[0], axes[i], corners);
    return m;
  }
};

TEST(DirectLight, PolygonFormulaKnownValue) {
  // A unit square at distance 1, seen from below its centre: 4/pi sqrt(1/5) atan(sqrt(1/5)) = 0.239456 (Howell B-4 /
  // F12 of a differential element, four quarters).
  const double quarter = 0.5 / std::sqrt(1.25);
  const double form = 4 / (2 * kPiD) * (2 * quarter * std::atan(quarter));
  EXPECT_NEAR(polygonLight({0, 0, 0}, {0, 1, 0}, {0, 1, 0}, {{-.5, 1, -.5}, {.5, 1, -.5}, {.5, 1, .5}, {-.5, 1, .5}}),
              form, 1e-12);
  EXPECT_NEAR(form, 0.239456, 1e-6);
}

TEST(DirectLight, PointLight) {
  Ground ground;
  Light light;
  light.position = {0.7f, 1.3f, -0.4f};
  light.intensity = 5.0f;
  ground.test.scene.lights = {light};
  expectAgreement(deviation(ground.test, {.samples = 64, .bounces = 0}, ground.page, [&](const Vec3d& p) {
    const Vec3d d = Vec3d(light.position) - p;
    return ground.fromDirection(glm::normalize(d), 5.0 / glm::dot(d, d));
  }));
}

/// Solid angle of a rectangle at y = 0 as a point at height h above the origin sees it.
double solidAngleBelow(double x0, double x1, double z0, double z1, double h) {
  const auto corner = [&](double x, double z) { return std::atan2(x * z, h * std::sqrt(x * x + z * z + h * h)); };
  return corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0);
}

// A lamp a thousandth of a texel above it: a texel's light is its solid angle times the intensity by its area, in every
// texel, whether the spot under the lamp lies in the middle, on a border or in a corner. Samples at points of the texel
// alone lost 9% of it 1 mm above one of 62.5 mm, and 77% at 0.1 mm.
TEST(DirectLight, LampsCloseToATexel) {
  const double texel = 0.5;
  for (const auto& [place, height] : {std::pair{Vec2(0.21f, 0.3f), 0.1f}, std::pair{Vec2(0.21f, 0.3f), 0.008f},
                                      std::pair{Vec2(0.25f, 0.25f), 0.0008f}, std::pair{Vec2(0.5f, 0.3f), 0.008f}}) {
    Ground ground;
    Light light;
    light.position = {place.x, height, place.y};
    light.intensity = 2.0f;
    ground.test.scene.lights = {light};
    for (const Integrator integrator : kIntegrators) {
      ground.test.integrator = integrator;
      const BakeResult result = ground.test.bake({.samples = 256, .bounces = 0});
      for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
          // Rows run from -z, where v = 1 is up, which is the image's top.
          const double x0 = -1 + texel * x - static_cast<double>(place.x);
          const double z0 = -1 + texel * y - static_cast<double>(place.y);
          const double want = 2.0 * solidAngleBelow(x0, x0 + texel, z0, z0 + texel, static_cast<double>(height)) /
                              (texel * texel) / kPiD;
          const double got = static_cast<double>(result.pages[static_cast<std::size_t>(ground.page)].flat.rgb(x, y).x);
          // 256 samples; within reach the split leaves a spread of about the half of a texel's light.
          EXPECT_NEAR(got / want, 1.0, 0.03) << x << ' ' << y << " height " << height;
        }
    }
  }
}

// All light of a lamp lands on the floor below: by the sum over texels, to the noise of eight seeds.
TEST(DirectLight, ALampCloseToATexelKeepsItsLight) {
  Ground ground;
  Light light;
  light.position = {0.2f, 0.004f, 0.3f};
  ground.test.scene.lights = {light};
  double sum = 0, squares = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const BakeResult result =
        ground.test.bake({.samples = 256, .bounces = 0, .seed = static_cast<std::uint64_t>(seed)});
    double mean = 0;
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x)
        mean += static_cast<double>(result.pages[static_cast<std::size_t>(ground.page)].flat.rgb(x, y).x) / 16;
    sum += mean / kSeeds;
    squares += mean * mean / kSeeds;
  }
  const double error = std::sqrt(std::max(0.0, squares - sum * sum) / (kSeeds - 1));
  const double want = solidAngleBelow(-1.2, 0.8, -1.3, 0.7, 0.004) / 4 / kPiD;
  EXPECT_NEAR(sum, want, 4 * error + 2e-5 * want);
  EXPECT_LT(error, 0.005 * want);
}

// A thousand lamps over the floor, more than can each be asked: by both integrators.
TEST(DirectLight, ManyPointLights) {
  Ground ground;
  std::vector<Light>& lights = ground.test.scene.lights;
  for (int i = 0; i < 1000; ++i) {
    Light light;
    light.position = {0.37f * static_cast<float>(i % 40) - 7.0f, 0.3f + 0.1f * static_cast<float>(i % 7),
                      0.5f * static_cast<float>(i / 40) - 6.0f};
    light.intensity = 0.5f + 0.25f * static_cast<float>(i % 11);
    lights.push_back(light);
  }
  for (const Integrator integrator : {Integrator::Path, Integrator::Gather}) {
    ground.test.integrator = integrator;
    expectAgreement(deviation(ground.test, {.samples = 1024, .bounces = 0}, ground.page, [&](const Vec3d& p) {
      Maps sum{};
      for (const Light& light : lights) {
        const Vec3d d = Vec3d(light.position) - p;
        const Maps one = ground.fromDirection(glm::normalize(d), static_cast<double>(light.intensity) / glm::dot(d, d));
        for (std::size_t i = 0; i < 4; ++i) sum[i] += one[i];
      }
      return sum;
    }));
  }
}

// Three lamps and a sun, a wall that hides each from a part of the floor: the gather's light samples go where shadows
// lie, and do not lean to either side.
TEST(DirectLight, SamplesThatFollowShadowsStayUnbiased) {
  Ground ground(8);
  // It stands askew: shadow borders along the grid would be met badly by the midpoints of the closed form. It hangs a
  // little over the ground, whose texels it would divide else, so that they would stand for one side of it.
  constexpr double kFoot = 0.03, kTop = 0.5;
  ground.test.addRectangle({-0.62f, kFoot, -1.2f}, {0, kTop - kFoot, 0}, {0.84f, 0, 2.4f}, {.texels = 0});
  const Vec3 places[3] = {{-0.8f, 0.6f, 0.3f}, {0.7f, 0.9f, -0.4f}, {0.2f, 1.5f, 0.0f}};
  for (const Vec3& place : places) {
    Light light;
    light.position = place;
    light.intensity = 3.0f;
    ground.test.scene.lights.push_back(light);
  }
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(-1, -1, 0.2f));
  sun.intensity = 2.0f;
  ground.test.scene.lights.push_back(sun);
  ground.test.integrator = Integrator::Gather;
  const auto lit = [](const Vec3d& p, const Vec3d& toLight, double length) {
    const double t = (0.35 * p.z - p.x - 0.2) / (toLight.x - 0.35 * toLight.z);
    if (!(t > 0) || t > length) return true;
    const double y = p.y + t * toLight.y;
    return y < kFoot || y > kTop || std::abs(p.z + t * toLight.z) > 1.2;
  };
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page, [&](const Vec3d& p) {
    Maps sum{};
    for (const Light& light : ground.test.scene.lights) {
      const bool isSun = light.type == LightType::Directional;
      const Vec3d d = isSun ? -Vec3d(light.direction) : Vec3d(light.position) - p;
      const double length = glm::length(d);
      if (!lit(p, d / length, isSun ? 1e9 : length)) continue;
      const Maps one =
          ground.fromDirection(d / length, static_cast<double>(light.intensity) / (isSun ? 1.0 : length * length));
      for (std::size_t i = 0; i < 4; ++i) sum[i] += one[i];
    }
    return sum;
  }));
}

TEST(DirectLight, PointLightRange) {
  Ground ground;
  Light light;
  light.position = {0, 1, 0};
  light.range = 1.5f;
  ground.test.scene.lights = {light};
  expectAgreement(deviation(ground.test, {.samples = 64, .bounces = 0}, ground.page, [&](const Vec3d& p) {
    const Vec3d d = Vec3d(0, 1, 0) - p;
    const double window = std::clamp(1 - std::pow(glm::length(d) / 1.5, 4), 0.0, 1.0);
    return ground.fromDirection(glm::normalize(d), window / glm::dot(d, d));
  }));
}

TEST(DirectLight, SpotLight) {
  Ground ground(8);
  Light light;
  light.type = LightType::Spot;
  light.position = {0.2f, 2.0f, 0.1f};
  light.direction = glm::normalize(Vec3(0.1f, -1.0f, 0.05f));
  light.innerConeAngle = 0.2f;
  light.outerConeAngle = 0.4f;
  light.intensity = 7.0f;
  ground.test.scene.lights = {light};
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page,
                            [&](const Vec3d& p) {
                              const Vec3d d = Vec3d(light.position) - p;
                              const double cd = glm::dot(-glm::normalize(d), Vec3d(light.direction));
                              // Straight from KHR_lights_punctual, "Inner and Outer Cone Angles".
                              const double scale = 1 / std::max(0.001, std::cos(0.2) - std::cos(0.4));
                              double cone = std::clamp(cd * scale - std::cos(0.4) * scale, 0.0, 1.0);
                              cone *= cone;
                              return ground.fromDirection(glm::normalize(d), 7 * cone / glm::dot(d, d));
                            }),
                  0.02);
}

TEST(DirectLight, Sun) {
  Ground ground(2);
  Light light;
  light.type = LightType::Directional;
  light.direction = glm::normalize(Vec3(-0.8f, -0.5f, 0.3f));
  light.intensity = 3.0f;
  ground.test.scene.lights = {light};
  expectAgreement(deviation(ground.test, {.samples = 1, .bounces = 0}, ground.page,
                            [&](const Vec3d&) { return ground.fromDirection(-Vec3d(light.direction), 3.0); }));
}

// Several lights: one shadow ray per sample chooses among them.
TEST(DirectLight, ManyLightsSumUp) {
  for (const int count : {5, 100}) {
    Ground ground(2);
    for (int i = 0; i < count; ++i) {
      Light light;
      light.position = {std::cos(static_cast<float>(i)), 1.0f + 0.01f * static_cast<float>(i),
                        std::sin(static_cast<float>(i) * 1.3f)};
      light.intensity = 1.0f + static_cast<float>(i % 7);
      ground.test.scene.lights.push_back(light);
    }
    expectAgreement(deviation(ground.test, {.samples = 512, .bounces = 0}, ground.page, [&](const Vec3d& p) {
      Maps sum{};
      for (const Light& light : ground.test.scene.lights) {
        const Vec3d d = Vec3d(light.position) - p;
        const Maps one = ground.fromDirection(glm::normalize(d), static_cast<double>(light.intensity) / glm::dot(d, d));
        for (std::size_t m = 0; m < 4; ++m) sum[m] += one[m];
      }
      return sum;
    }));
  }
}

// One quarter of the rectangle lies below the horizon of B1 or B2 at some texels: the clipping is exercised.
TEST(DirectLight, RectangleLight) {
  Ground ground;
  const int lamp = ground.test.addMaterial(Vec3(0.0f), Vec3(2.0f));
  ground.test.addRectangle({0.2f, 0.9f, -1.5f}, {2, 0, 0}, {0, 0, 2}, {.material = lamp, .texels = 0});
  const std::vector<Vec3d> corners = {{0.2, 0.9, -1.5}, {2.2, 0.9, -1.5}, {2.2, 0.9, 0.5}, {0.2, 0.9, 0.5}};
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page, [&](const Vec3d& p) {
    Maps m = ground.fromPolygon(p, corners);
    for (double& v : m) v *= 2;
    return m;
  }));
}

// A lamp that touches the receiver's plane: near-singular for area sampling, met by multiple importance sampling.
TEST(DirectLight, LampThatTouchesTheGround) {
  Ground ground;
  const int lamp = ground.test.addMaterial(Vec3(0.0f), Vec3(1.0f));
  ground.test.addRectangle({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, {.material = lamp, .texels = 0});
  const std::vector<Vec3d> corners = {{-1, 0, -1}, {1, 0, -1}, {1, 2, -1}, {-1, 2, -1}};
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page,
                            [&](const Vec3d& p) { return ground.fromPolygon(p, corners); }),
                  0.02);
}

TEST(DirectLight, LampShinesFromItsFrontUnlessDoubleSided) {
  for (const bool doubleSided : {false, true})
    for (const bool flip : {false, true}) {
      Ground ground(2);
      const int lamp = ground.test.addMaterial(Vec3(0.0f), Vec3(1.0f));
      ground.test.scene.materials[static_cast<std::size_t>(lamp)].doubleSided = doubleSided;
      ground.test.addRectangle({-1, 1, 1}, {2, 0, 0}, {0, 0, -2},
                               {.material = lamp, .texels = 0, .flip = flip});  // faces up
      const BakeResult result = ground.test.bake({.samples = 64, .bounces = 2});
      EXPECT_EQ(result.pages[0].flat.rgb(0, 0).x > 0.01f, doubleSided) << "mirrored: " << flip;
    }
}

// Only the right half of the lamp shines: the texture's columns are black and white.
TEST(DirectLight, TexturedLamp) {
  Ground ground;
  const int lamp = ground.test.addMaterial(Vec3(0.0f), Vec3(3.0f));
  Material& material = ground.test.scene.materials[static_cast<std::size_t>(lamp)];
  material.emissionMap.image = ground.test.addImage(2, 1, {{0, 0, 0, 1}, {1, 1, 1, 1}});
  material.emissionMap.nearest = true;
  ground.test.addRectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {.material = lamp, .texels = 0});
  const std::vector<Vec3d> corners = {{0, 1, -1}, {1, 1, -1}, {1, 1, 1}, {0, 1, 1}};
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page,
                            [&](const Vec3d& p) {
                              Maps m = ground.fromPolygon(p, corners);
                              for (double& v : m) v *= 3;
                              return m;
                            }),
                  0.02);
}

TEST(DirectLight, UniformSky) {
  Ground ground(2);
  ground.test.scene.environment.color = Vec3(1.0f);
  const double tilted = (1 + 1 / std::sqrt(3.0)) / 2;  // 0.788675 (lightmap/maps/README.md, "Raw")
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page, [&](const Vec3d&) {
    return Maps{1, tilted, tilted, tilted};
  }));
}

// The same sky as an image: sampled by its table and by gather rays, joined by multiple importance sampling.
TEST(DirectLight, UniformSkyAsAnImage) {
  Ground ground(2);
  ground.test.scene.environment.image = Image(16, 8, 3, 0.5f);
  ground.test.scene.environment.strength = 2.0f;
  const double tilted = (1 + 1 / std::sqrt(3.0)) / 2;
  expectAgreement(deviation(ground.test, {.samples = 256, .bounces = 0}, ground.page, [&](const Vec3d&) {
    return Maps{1, tilted, tilted, tilted};
  }));
}

TEST(DirectLight, SkyWithABrightSpotAgainstNumericIntegration) {
  for (const float rotation : {0.0f, 130.0f}) {
    Ground ground(2);
    Environment& sky = ground.test.scene.environment;
    sky.image = Image(64, 32, 3, 0.0f);
    sky.image.setRgb(20, 9, Vec3(1000.0f));
    sky.image.setRgb(50, 3, Vec3(200.0f));
    sky.rotationDegrees = rotation;
    Maps truth{};
    constexpr int kRows = 1024, kColumns = 2048;
    for (int row = 0; row < kRows / 2; ++row)
      for (int column = 0; column < kColumns; ++column) {
        const double polar = kPiD * (row + 0.5) / kRows, azimuth = 2 * kPiD * (column + 0.5) / kColumns;
        const Vec3d w(std::sin(polar) * std::cos(azimuth), std::cos(polar), std::sin(polar) * std::sin(azimuth));
        const double solidAngle = std::sin(polar) * (kPiD / kRows) * (2 * kPiD / kColumns);
        const Maps one = ground.fromDirection(w, static_cast<double>(environmentRadiance(sky, Vec3(w)).x) * solidAngle);
        for (std::size_t m = 0; m < 4; ++m) truth[m] += one[m];
      }
    Deviation d =
        deviation(ground.test, {.samples = 1024, .bounces = 0}, ground.page, [&](const Vec3d&) { return truth; });
    // The numeric integral itself is good to about 1e-4 (midpoints of a bilinear image, 32 per pixel).
    for (std::size_t m = 0; m < 4; ++m) d.standardError[m] += 0.25e-4 * d.expected[m];
    expectAgreement(d);
  }
}

// A pipe of 16 facets under the sun has the light of a round one: where its shade begins no facet is dark as a whole,
// and none lies in the shadow of its neighbour.
TEST(DirectLight, RoundThingsAreNotShadedByTheirFacets) {
  constexpr int kFacets = 16, kTexels = 8;
  TestScene test;
  const auto normalAt = [](double turn) {
    return Vec3d(std::cos(2 * kPiD * turn / kFacets), std::sin(2 * kPiD * turn / kFacets), 0);
  };
  // The first facet stands upright: half of it is in the light of the round pipe.
  for (int k = 0; k < kFacets; ++k) {
    const Vec3 from(normalAt(k - 0.5)), to(normalAt(k + 0.5));
    test.addRectangle(from, to - from, {0, 0, 1}, {.texels = kTexels});
    test.atlas.surfaces.back().normals = {from, to, to, from};
    test.scene.meshes.back().primitives[0].normals = {from, to, to, from};
  }
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.intensity = static_cast<float>(kPiD);
  test.scene.lights = {sun};
  for (const Integrator integrator : {Integrator::Path, Integrator::Gather}) {
    test.integrator = integrator;
    const BakeResult result = test.bake({.samples = 256, .bounces = 0});
    for (int k = 0; k < kFacets; ++k)
      for (int x = 0; x < kTexels; ++x) {
        double expected = 0;
        for (int i = 0; i < 64; ++i) {
          const double share = (x + (i + 0.5) / 64) / kTexels;
          expected += std::max(0.0, glm::normalize(glm::mix(normalAt(k - 0.5), normalAt(k + 0.5), share)).y) / 64;
        }
        // At least 32 points of a texel, across which the light changes by at most 0.05.
        EXPECT_NEAR(static_cast<double>(result.pages[static_cast<std::size_t>(k)].flat.rgb(x, kTexels / 2).x), expected,
                    6e-3)
            << "facet " << k << ", texel " << x;
      }
  }
}

TEST(DirectLight, NoLightsIsBlackAndCheap) {
  Ground ground;
  ground.test.addRoom({-5, -1, -5}, {5, 5, 5});
  const BakeResult result = ground.test.bake({.samples = 64, .bounces = 8});
  for (const BakedPage& page : result.pages)
    for (const float v : page.flat.pixels) ASSERT_EQ(v, 0.0f);
  EXPECT_EQ(result.stats.shadowRays, 0u);
  EXPECT_LE(result.stats.rays, 64u * result.stats.texels);
}

/// A facet of a column of eight sides whose normals make it round, 1 m wide and 0.4 m high, facing +z.
struct RoundFacet {
  TestScene test;
  int page = 0;

  explicit RoundFacet(const Vec3d& towardsSun) {
    page = test.addRectangle({-0.5f, 0, 0}, {1, 0, 0}, {0, 0.4f, 0}, {.texels = 8});
    Surface& surface = test.atlas.surfaces[0];
    for (std::size_t i = 0; i < surface.normals.size(); ++i)
      surface.normals[i] = normalAt(static_cast<double>(surface.positions[i].x));
    test.scene.meshes[0].primitives[0].normals = surface.normals;
    Light sun;
    sun.type = LightType::Directional;
    sun.direction = -Vec3(towardsSun);
    sun.color = Vec3(static_cast<float>(kPiD));
    test.scene.lights = {sun};
  }
  /// Of the normals that are interpolated from corner to corner.
  static Vec3 normalAt(double x) {
    const double lean = kPiD / 8;
    return Vec3(glm::normalize(Vec3d(2 * x * std::sin(lean), 0, std::cos(lean))));
  }
};

// The sun stands below the plane of the facet, and above the round surface on its right.
TEST(DirectLight, CoarseRoundThingsAreLitBeyondTheirFacets) {
  const Vec3d sun(std::sin(1.7), 0, std::cos(1.7));  // 97 degrees from the facet's normal
  RoundFacet facet(sun);
  for (const Integrator integrator : kIntegrators) {
    facet.test.integrator = integrator;
    const BakeResult result = facet.test.bake({.samples = 64, .bounces = 0});
    const Image& flat = result.pages[static_cast<std::size_t>(facet.page)].flat;
    for (int x = 0; x < 8; ++x) {
      const double right = std::max(0.0, glm::dot(Vec3d(RoundFacet::normalAt((x + 0.5) / 8 - 0.5)), sun));
      // A texel's light is the mean of a clamped cosine that changes by .05 from side to side. At the facet's edges
      // the round surface and the facet are one: 1% of the last texel's points are too close to tell.
      EXPECT_NEAR(static_cast<double>(flat.rgb(x, 4).x), right, 0.02) << x;
    }
  }
}

// The round surface swells 19 cm over the facet; a rim stands out 5 cm over the top of it.
TEST(DirectLight, WhatStandsOverCoarseRoundThingsShadesThem) {
  RoundFacet facet({0, 0.8, 0.6});
  facet.test.addRectangle({-0.5f, 0.4f, 0}, {1, 0, 0}, {0, 0, 0.05f}, {.texels = 0});
  for (const Integrator integrator : kIntegrators) {
    facet.test.integrator = integrator;
    const BakeResult result = facet.test.bake({.samples = 64, .bounces = 0});
    const Image& flat = result.pages[static_cast<std::size_t>(facet.page)].flat;
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(flat.rgb(x, 0).x, 0.0f) << x;  // the shadow is 6.7 cm high, a texel 5
      EXPECT_GT(flat.rgb(x, 2).x, 0.5f) << x;
    }
  }
}

}  // namespace
}  // namespace lumel
