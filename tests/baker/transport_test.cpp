// What a bake promises as a whole: the same bytes for any thread count, cut-outs, instances, far and tiny scenes,
// closed rooms, and the figures that it reports.
#include <gtest/gtest.h>

#include "baker/rays/ray_scene.h"
#include "tests/baker/test_scene.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

using namespace testing_scene;

TEST(Transport, SameBytesForAnyThreadCount) {
  const TestScene test = busyRoom();
  const BakeOptions options{.samples = 48, .bounces = 3};
  const BakeResult one = test.bake(options, 1);
  EXPECT_GT(one.stats.meanFlat, 0.1);
  EXPECT_TRUE(sameBytes(one, test.bake(options, 2)));
  EXPECT_TRUE(sameBytes(one, test.bake(options, 4)));
  BakeOptions other = options;
  other.seed = 2;
  EXPECT_FALSE(sameBytes(one, test.bake(other, 1)));
}

// The maps do not change when everything is scaled (candela with the square of it) or moved.
TEST(Transport, SizeAndPlaceDoNotMatter) {
  const BakeOptions options{.samples = 256, .bounces = 3};
  const BakeResult reference = busyRoom().bake(options);
  struct Case {
    float scale;
    Vec3 offset;
    double tolerance;
  };
  // The same random numbers are used, so that only rounding and paths that flip at an edge differ. At 1e6 m a float
  // has steps of 1/16 m, of which the room (400 m) has 6400 on a side, and rays start 1 m off their surface.
  for (const auto& [scale, offset, tolerance] :
       {Case{1e-4f, Vec3(0.0f), 1e-3}, Case{1e4f, Vec3(0.0f), 1e-3}, Case{128.0f, Vec3(1e6f, 1e6f, -1e6f), 2e-2}}) {
    const BakeResult moved = busyRoom(scale, offset).bake(options);
    EXPECT_NEAR(moved.stats.meanFlat / reference.stats.meanFlat, 1.0, tolerance) << "scale " << scale;
    for (std::size_t p = 0; p < 2; ++p) {
      double square = 0, sum = 0;
      for (std::size_t i = 0; i < reference.pages[p].flat.pixels.size(); ++i) {
        const double d = static_cast<double>(moved.pages[p].flat.pixels[i] - reference.pages[p].flat.pixels[i]);
        square += d * d;
        sum += static_cast<double>(reference.pages[p].flat.pixels[i] * reference.pages[p].flat.pixels[i]);
      }
      EXPECT_LT(std::sqrt(square / sum), 5 * tolerance) << "scale " << scale << " page " << p;
    }
  }
}

// A roof over a sky: its texture's left half is opaque, the right half cut out. What is left of the sky under a roof
// that reaches far is the right half of the roof's rectangle plus what passes outside it.
TEST(Transport, MaskCutsOut) {
  for (const bool vertexAlpha : {false, true}) {
    TestScene test;
    const int page = test.addRectangle({-0.5f, 0, 0.5f}, {1, 0, 0}, {0, 0, -1});
    const int roof = test.addMaterial(Vec3(0.0f));
    Material& m = test.scene.materials[static_cast<std::size_t>(roof)];
    m.alphaMode = AlphaMode::Mask;
    m.alphaCutoff = vertexAlpha ? 0.5f : 0.6f;
    if (!vertexAlpha) {
      m.baseColorMap.image = test.addImage(2, 1, {{1, 1, 1, 1}, {1, 1, 1, 0.5f}});
      m.baseColorMap.nearest = true;
    }
    test.addRectangle({-2, 1, -2}, {4, 0, 0}, {0, 0, 4}, {.material = roof, .texels = 0});
    if (vertexAlpha)
      test.scene.meshes.back().primitives[0].colors = {{1, 1, 1, 1}, {1, 1, 1, 0}, {1, 1, 1, 0}, {1, 1, 1, 1}};
    test.scene.environment.color = Vec3(1.0f);
    const std::vector<Vec3d> closed = {{-2, 1, -2}, {0, 1, -2}, {0, 1, 2}, {-2, 1, 2}};
    const double tilted = (1 + 1 / std::sqrt(3.0)) / 2;
    expectAgreement(deviation(test, {.samples = 256, .bounces = 0}, page, [&](const Vec3d& p) {
      Maps maps{};
      for (int i = 0; i < 4; ++i)
        maps[static_cast<std::size_t>(i)] =
            (i == 0 ? 1 : tilted) -
            polygonLight(p, axisInWorld(test, page, -1), axisInWorld(test, page, i - 1), closed);
      return maps;
    }));
  }
}

TEST(Transport, BlendHoldsItsShare) {
  TestScene test;
  const int page = test.addRectangle({-0.5f, 0, 0.5f}, {1, 0, 0}, {0, 0, -1});
  const int glass = test.addMaterial(Vec3(0.0f));
  test.scene.materials[static_cast<std::size_t>(glass)].alphaMode = AlphaMode::Blend;
  test.scene.materials[static_cast<std::size_t>(glass)].baseColor.w = 0.25f;
  test.addRectangle({-2, 1, -2}, {4, 0, 0}, {0, 0, 4}, {.material = glass, .texels = 0});
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = {0, -1, 0};
  sun.intensity = kPi;
  test.scene.lights = {sun};
  const double tilted = 0.75 / std::sqrt(3.0);
  expectAgreement(deviation(test, {.samples = 1024, .bounces = 0}, page, [&](const Vec3d&) {
    return Maps{0.75, tilted, tilted, tilted};
  }));
}

// Bounce light of one wall onto the floor, by closed form: a wall of albedo rho lit by a sun that does not reach the
// floor is a lamp of radiance rho E cos / pi.
/// A pane between a floor and an even sky: the floor has transmission times base colour of it, by both integrators.
TEST(Transport, GlassTintsTheSky) {
  const Vec3 color(0.2f, 0.8f, 0.4f);
  for (const Integrator integrator : {Integrator::Path, Integrator::Gather}) {
    TestScene test;
    test.integrator = integrator;
    test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.texels = 2});
    const int glass = test.addMaterial(color);
    test.scene.materials[static_cast<std::size_t>(glass)].transmission = 0.5f;
    // So large that next to nothing of the hemisphere is left around it.
    test.addRectangle({-1000, 1, -1000}, {2000, 0, 0}, {0, 0, 2000}, {.material = glass, .texels = 0});
    test.scene.environment.color = Vec3(1.0f);
    const BakeResult result = test.bake({.samples = 4096, .bounces = 0});
    const Vec3 light = result.pages[0].flat.rgb(0, 0);
    // 4096 rays, 0.4 of which pass: 2% is two and a half standard deviations of a plain draw, and draws are stratified.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(light[c], 0.5f * color[c], 0.02f * 0.5f + 0.02f * 0.5f * color[c]);
  }
}

TEST(Transport, OneBounceIsALamp) {
  for (const bool unlit : {false, true}) {
    TestScene test;
    const int page = test.addRectangle({-1, 0, 2}, {2, 0, 0}, {0, 0, -1.9f});
    const int wall = test.addMaterial(Vec3(0.5f), unlit ? Vec3(9.0f) : Vec3(0.0f));
    test.scene.materials[static_cast<std::size_t>(wall)].unlit = unlit;  // reflects, and its emission is no light
    test.addRectangle({-1, 0.5f, 0}, {2, 0, 0}, {0, 2, 0}, {.material = wall, .texels = 0});
    Light sun;
    sun.type = LightType::Directional;
    sun.direction = glm::normalize(Vec3(0, 1, -2));  // from below: lights the wall alone
    sun.intensity = 3.0f;
    test.scene.lights = {sun};
    // The floor must not shade the wall from the sun below it.
    test.scene.instances[0].settings.casts = false;
    const double radiance = 0.5 * 3 * (2 / std::sqrt(5.0)) / std::numbers::pi;
    const std::vector<Vec3d> corners = {{-1, 0.5, 0}, {1, 0.5, 0}, {1, 2.5, 0}, {-1, 2.5, 0}};
    expectAgreement(deviation(test, {.samples = 1024, .bounces = 1}, page,
                              [&](const Vec3d& p) {
                                Maps maps{};
                                for (int i = 0; i < 4; ++i)
                                  maps[static_cast<std::size_t>(i)] =
                                      radiance * polygonLight(p, axisInWorld(test, page, -1),
                                                              axisInWorld(test, page, i - 1), corners);
                                return maps;
                              }),
                    0.02);
  }
}

/// Puts a speck below everything that has so many triangles that instances are not flattened.
void crowd(TestScene& test) {
  test.addRectangle({0, -100, 0}, {0.001f, 0, 0}, {0, 0, -0.001f}, {.texels = 0});
  Primitive& speck = test.scene.meshes.back().primitives[0];
  const std::vector<std::uint32_t> one = speck.indices;
  while (speck.triangleCount() < RayScene::kMostFlattened / 4)
    speck.indices.insert(speck.indices.end(), one.begin(), one.end());
  const int first = static_cast<int>(test.scene.instances.size()) - 1;
  for (int i = 1; i < 5; ++i) test.addInstance(first, Mat4(1.0f));
}

TEST(Transport, InstancesBakeAsCopiesDo) {
  const auto scene = [](bool instanced) {
    TestScene test;
    test.addRectangle({-2, 0, 2}, {4, 0, 0}, {0, 0, -4});
    const int paint = test.addMaterial({0.9f, 0.1f, 0.1f}, {0.5f, 0.5f, 0.5f});
    for (int i = 0; i < 3; ++i) {
      Mat4 place(1.0f);
      place[3] = Vec4(static_cast<float>(i) - 1.0f, 0.25f * static_cast<float>(i), 0, 1);
      if (instanced && i > 0) {
        test.addInstance(1, place);
        continue;
      }
      test.addRectangle({0, 0.5f, 0}, {0.7f, 0, 0}, {0, 0.7f, 0.1f}, {.material = paint, .texels = 0});
      test.scene.instances.back().worldFromObject = place;
    }
    test.scene.environment.color = Vec3(0.5f);
    return test;
  };
  TestScene crowded = scene(true);
  crowd(crowded);
  const BakeResult copies = scene(false).bake({.samples = 256, .bounces = 2});
  const BakeResult flattened = scene(true).bake({.samples = 256, .bounces = 2});
  const BakeResult placed = crowded.bake({.samples = 256, .bounces = 2});
  // The same random numbers: rounding apart, a few paths in a hundred thousand may flip at an edge.
  for (std::size_t i = 0; i < copies.pages[0].flat.pixels.size(); ++i) {
    const float expected = copies.pages[0].flat.pixels[i];
    EXPECT_NEAR(flattened.pages[0].flat.pixels[i], expected, 2e-3f * expected);
    EXPECT_NEAR(placed.pages[0].flat.pixels[i], expected, 2e-3f * expected);
  }
}

// A bright sky and sun outside a closed room: not one ray may find them. About a million rays and as many shadow rays.
TEST(Transport, ClosedRoomsStayBlack) {
  for (const auto& [min, size] :
       {std::pair{Vec3(0.0f), 3.0f}, {Vec3(1e6f, 0, -1e6f), 300.0f}, {Vec3(0.1f, 0.2f, 0.3f), 0.7f}}) {
    TestScene test;
    test.addRoom(min, min + Vec3(size), {.material = test.addMaterial(Vec3(0.8f)), .texels = 16});
    test.scene.environment.image = Image(8, 4, 3, 1e6f);
    Light sun;
    sun.type = LightType::Directional;
    sun.direction = glm::normalize(Vec3(1, -2, 0.5f));
    sun.intensity = 1e6f;
    test.scene.lights = {sun};
    const BakeResult result = test.bake({.samples = 64, .bounces = 3});
    EXPECT_GT(result.stats.rays, 300000u);
    int lit = 0;
    for (const BakedPage& page : result.pages)
      for (const float v : page.flat.pixels) lit += v != 0.0f;
    EXPECT_EQ(lit, 0) << "size " << size;
  }
}

TEST(Transport, AuxChannels) {
  TestScene test;
  const int inside = test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  // A lid that turns its back to the rectangle, single-sided: most gather rays meet a back face.
  test.addRectangle({-50, 0.5f, 50}, {100, 0, 0}, {0, 0, -100}, {.texels = 2});
  test.scene.environment.color = Vec3(1.0f);
  const BakeResult result = test.bake({.samples = 100, .bounces = 1});
  const auto page = static_cast<std::size_t>(inside);
  const float* aux = result.pages[page].aux.at(1, 1);
  EXPECT_FLOAT_EQ(aux[0], 1.0f);
  EXPECT_LT(aux[1], 0.1f);
  EXPECT_EQ(aux[3], 100.0f);
  const float* lidAux = result.pages[1].aux.at(0, 0);
  EXPECT_EQ(lidAux[1], 1.0f);
  test.scene.materials[0].doubleSided = true;
  EXPECT_EQ(test.bake({.samples = 16, .bounces = 0}).pages[page].aux.at(1, 1)[1], 1.0f);
}

// The reported standard error against the true spread over seeds. It comes from stretches of one Owen-scrambled
// sequence, whose errors partly cancel in the whole: it may be too large (up to 3x is seen), never too small.
TEST(Transport, StandardErrorIsHonest) {
  const TestScene test = busyRoom();
  constexpr int kRuns = 24;
  std::vector<double> sum, squares, claimed;
  for (int run = 0; run < kRuns; ++run) {
    const BakeResult result = test.bake({.samples = 128, .bounces = 2, .seed = static_cast<std::uint64_t>(run) + 100});
    const BakedPage& page = result.pages[0];
    sum.resize(13 * 13);
    squares.resize(13 * 13);
    claimed.resize(13 * 13);
    for (int y = 0; y < 13; ++y)
      for (int x = 0; x < 13; ++x) {
        const auto i = static_cast<std::size_t>(y * 13 + x);
        const double v = static_cast<double>(luminance(page.flat.rgb(x, y)));
        sum[i] += v;
        squares[i] += v * v;
        claimed[i] += static_cast<double>(page.aux.at(x, y)[2]) * static_cast<double>(page.aux.at(x, y)[2]) / kRuns;
      }
  }
  double trueVariance = 0, claimedVariance = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double mean = sum[i] / kRuns;
    trueVariance += (squares[i] / kRuns - mean * mean) * kRuns / (kRuns - 1);
    claimedVariance += claimed[i];
  }
  const double ratio = std::sqrt(claimedVariance / trueVariance);
  std::printf("claimed / true standard error: %.2f\n", ratio);
  EXPECT_GT(ratio, 0.95);
  EXPECT_LT(ratio, 3.0);
}

TEST(Transport, ProjectionResidualMatchesDesign) {
  // Light from everywhere: with `flat` scaling every normal decodes to 1; the truth for a normal tilted by t is
  // (1 + cos t)/2, for the light below the surface's horizon is lost. Over the probes (one flat, three at 15 degrees,
  // three at 30): sqrt(3/7 ((1-cos15)/2)^2 + 3/7 ((1-cos30)/2)^2) = 0.0452.
  TestScene test;
  test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  test.scene.environment.color = Vec3(1.0f);
  const BakeResult result = test.bake({.samples = 1024, .bounces = 0});
  const auto loss = [](double degrees) { return (1 - std::cos(degrees * std::numbers::pi / 180)) / 2; };
  const double expected = std::sqrt(3.0 / 7 * (loss(15) * loss(15) + loss(30) * loss(30)));
  EXPECT_NEAR(result.stats.projectionResidual, expected, 0.002);  // noise of 1024 samples
}

TEST(Transport, AnySampleCount) {
  const TestScene test = busyRoom();
  for (const int samples : {1, 2, 3, 17}) {
    const BakeResult result = test.bake({.samples = samples, .bounces = 1});
    EXPECT_EQ(result.pages[0].aux.at(0, 0)[3], static_cast<float>(samples));
    EXPECT_GT(result.stats.meanFlat, 0.05);
  }
}

// An infinite emission cannot be summed: the samples that meet it are named and left out.
TEST(Transport, NonFiniteSamplesAreNamed) {
  TestScene test;
  test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.texels = 2});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(std::numeric_limits<float>::infinity()));
  test.addRectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {.material = lamp, .texels = 0});
  test.scene.environment.color = Vec3(1.0f);
  const auto result = test.tryBake({.samples = 64, .bounces = 0, .seed = 5});
  ASSERT_TRUE(result);
  EXPECT_GT(result->stats.nonFiniteSamples, 10u);
  ASSERT_EQ(result->stats.notes.size(), 10u);
  EXPECT_TRUE(mentions(result->stats.notes[0], "page 0, texel ("));
  EXPECT_TRUE(mentions(result->stats.notes[0], "), sample "));
  EXPECT_TRUE(mentions(result->stats.notes[0], "seed 5"));
  for (const float v : result->pages[0].flat.pixels) EXPECT_TRUE(std::isfinite(v));
}

TEST(Transport, Interrupted) {
  struct Stop : Progress {
    bool cancelled() const override { return true; }
  };
  const TestScene test = busyRoom();
  Stop stop;
  const auto result =
      lumel::bake(test.scene, test.atlas, findTexels(test.atlas), {.integrator = Integrator::Path, .samples = 4}, stop);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Interrupted);
}

Light sunOf(const Vec3& direction, float lux) {
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(direction);
  sun.intensity = lux;
  return sun;
}

Light lampAt(const Vec3& position, float candela) {
  Light lamp;
  lamp.position = position;
  lamp.intensity = candela;
  return lamp;
}

/// The RMS difference of two seeds over a page, relative to its mean, and that mean.
std::pair<double, double> noiseOf(const TestScene& test, BakeOptions options) {
  options.seed = 1;
  const BakeResult one = test.bake(options);
  options.seed = 2;
  const BakeResult two = test.bake(options);
  double squares = 0, sum = 0, count = 0;
  for (std::size_t p = 0; p < one.pages.size(); ++p)
    for (std::size_t i = 0; i < one.pages[p].flat.pixels.size(); ++i) {
      const auto a = static_cast<double>(one.pages[p].flat.pixels[i]);
      const auto b = static_cast<double>(two.pages[p].flat.pixels[i]);
      squares += 0.5 * (a - b) * (a - b);
      sum += 0.5 * (a + b);
      count += 1;
    }
  return {std::sqrt(squares / count) / (sum / count), sum / count};
}

// Lamps in a closed room: a sun outside that is a thousand times as strong changes neither light nor noise.
TEST(Transport, ASunOutsideCostsNothing) {
  TestScene test;
  test.addRoom({0, 0, 0}, {4, 3, 4}, {.material = test.addMaterial(Vec3(0.5f)), .texels = 8});
  test.scene.lights = {lampAt({1, 2.5f, 1}, 100), lampAt({3, 2, 2}, 100), lampAt({2, 1, 3.2f}, 100)};
  const BakeOptions options{.samples = 64, .bounces = 4};
  const auto [noise, mean] = noiseOf(test, options);
  test.scene.lights.push_back(sunOf({0.3f, -1, 0.2f}, 1e5f));
  const auto [noiseBySun, meanBySun] = noiseOf(test, options);
  std::printf("noise without a sun %.4f, with it %.4f\n", noise, noiseBySun);
  // A tenth of the samples still asks for the sun: 5% more noise. What it was by unshadowed light: 20 times as much.
  EXPECT_LT(noiseBySun, 1.25 * noise);
  EXPECT_NEAR(meanBySun / mean, 1.0, 0.01);
}

// The floor is half under a roof with a lamp beneath it and half under the sun: what was learnt from the one half must
// not cost the other its light.
TEST(Transport, LearntChoicesAreUnbiased) {
  TestScene test;
  const int page = test.addRectangle({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, {.texels = 8});
  test.addRectangle({-20, 1, -20}, {20, 0, 0}, {0, 0, 40}, {.material = test.addMaterial(Vec3(0.0f)), .texels = 0});
  const Light sun = sunOf({0, -1, 0}, 30.0f), lamp = lampAt({-1, 0.8f, 0}, 2.0f), other = lampAt({0.5f, 0.9f, 1}, 1.0f);
  test.scene.lights = {sun, lamp, other};
  std::array<Vec3d, 4> axes;
  for (int i = 0; i < 4; ++i) axes[static_cast<std::size_t>(i)] = axisInWorld(test, page, i - 1);
  expectAgreement(deviation(test, {.samples = 256, .bounces = 0}, page, [&](const Vec3d& p) {
    Maps maps{};
    for (std::size_t i = 0; i < 4; ++i) {
      if (p.x > 0) maps[i] += 30.0 / std::numbers::pi * axes[i].y;
      for (const Light& light : {lamp, other}) {
        const Vec3d d = Vec3d(light.position) - p;
        maps[i] += static_cast<double>(light.intensity) / glm::dot(d, d) / std::numbers::pi *
                   std::max(0.0, glm::dot(glm::normalize(d), axes[i]));
      }
    }
    return maps;
  }));
}

}  // namespace
}  // namespace lumel
