#include "baker/gather/space_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <tuple>
#include <vector>

#include "baker/bake/gather_session.h"
#include "baker/light/lit_scene.h"
#include "baker/rays/sampling.h"
#include "scene/base/parallel.h"
#include "scene/base/sobol.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr std::size_t kPoints = 100;

/// A baked scene whose surfaces can be asked.
struct Asked {
  TestScene test;
  std::unique_ptr<LitScene> lit;
  std::vector<PageTexels> texels;
  SurfaceCache* surfaces = nullptr;
  GatherSession session;

  Asked(TestScene scene, const BakeOptions& options) : test(std::move(scene)), texels(findTexels(test.atlas)) {
    auto built = LitScene::build(test.scene, true);
    EXPECT_TRUE(built);
    lit = *std::move(built);
    session.keepsSurfaces = true;
    EXPECT_TRUE(bake(*lit, test.atlas, texels, options, noProgress(), &session));
    surfaces = &*session.surfaces;
  }
  std::vector<SpaceLight> at(std::span<const Vec3> points, const SpaceOptions& options) const {
    return *gatherInSpace(lit->transport(), *surfaces, points, options, noProgress());
  }
};

/// Inside of a box.
std::vector<Vec3> freePoints(const Vec3& min, const Vec3& max) {
  std::vector<Vec3> points;
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    const Vec2 u = sobol2D(i, 11);
    points.push_back(min + (max - min) * Vec3(u.x, u.y, sobol1D(i, 12)));
  }
  return points;
}

// In a closed box whose walls emit 1 and reflect a half, 2 arrives from everywhere; with N bounces 2 - 2^-N. Every ray
// meets it, so a point's noise is that of emission alone, found by hits or by light samples: with 1024 of each below 1%
// at each point, and a tenth of it in the mean. The linear terms are
// sums of 1024 directions, which would scatter by 3% of the constant one were they independent; they have up to 3.3%.
TEST(SpacePoints, Furnace) {
  for (const int bounces : {kAllBounces, 0, 1, 3}) {
    TestScene box;
    box.addRoom({0, 0, 0}, {1, 1, 1}, {.material = box.addMaterial(Vec3(0.5f), Vec3(1.0f)), .texels = 8});
    const Asked furnace(box, {.samples = 256, .bounces = bounces});
    const float expected = bounces < 0 ? 2.0f : 2.0f - std::exp2(-static_cast<float>(bounces));
    const std::vector<Vec3> points = freePoints(Vec3(0.02f), Vec3(0.98f));
    double mean = 0.0;
    for (const SpaceLight& light : furnace.at(points, {.samples = 1024})) {
      EXPECT_NEAR(light.meanRadiance().x, expected, 0.01f * expected);
      for (std::size_t k = 1; k < 4; ++k) EXPECT_NEAR(light.sh[k].x / light.sh[0].x, 0.0f, 0.05f);
      EXPECT_EQ(light.backFaces, 0.0f);
      mean += static_cast<double>(light.meanRadiance().x) / kPoints;
    }
    EXPECT_NEAR(mean, static_cast<double>(expected), 0.001 * static_cast<double>(expected)) << bounces;
  }
}

/// A box of Cornell's kind: a red and a green wall, a lamp below the ceiling that shines down, a block.
TestScene cornell() {
  TestScene test;
  const int white = test.addMaterial(Vec3(0.73f)), red = test.addMaterial({0.63f, 0.06f, 0.05f});
  const int green = test.addMaterial({0.14f, 0.45f, 0.09f}), lamp = test.addMaterial(Vec3(0.0f), {17, 12, 4});
  const auto wall = [&](const Vec3& corner, const Vec3& right, const Vec3& up, int material) {
    test.addRectangle(corner, right, up, {.material = material, .texels = 16});
  };
  wall({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, white);    // floor
  wall({1, 1, 1}, {-1, 0, 0}, {0, 0, -1}, white);  // ceiling
  wall({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, red);
  wall({1, 1, 1}, {0, 0, -1}, {0, -1, 0}, green);
  wall({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, white);
  wall({1, 1, 1}, {0, -1, 0}, {-1, 0, 0}, white);
  test.addRectangle({0.65f, 0.98f, 0.65f}, {-0.3f, 0, 0}, {0, 0, -0.3f}, {.material = lamp});
  wall({0.6f, 0.3f, 0.3f}, {-0.3f, 0, 0}, {0, 0, -0.2f}, white);  // a shelf that looks down
  wall({0.3f, 0.31f, 0.1f}, {0, 0, 0.2f}, {0.3f, 0, 0}, white);   // and up
  return test;
}

/// What paths from a point find, by emission that they hit alone: independent of light samples and of the cache.
struct Traced {
  std::array<Vec3d, 4> sh{};
  double standardError = 0.0;  // of sh[0]'s luminance
};

Traced tracePaths(const LightTransport& transport, const Vec3& point, std::uint32_t seed, std::uint32_t paths) {
  Traced result;
  double sum = 0.0, squares = 0.0;
  for (std::uint32_t first = 0; first < paths; first += kLanes) {
    std::array<Vec3, kLanes> start, direction, from, beta, light{};
    std::array<bool, kLanes> goesOn;
    std::uint32_t random = hashBits(seed * 0x9e3779b9u + first);
    const auto next = [&] { return unitFloat(random = hashBits(random + 0x6d2b79f5u)); };
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec2 u(next(), next());
      from[lane] = direction[lane] = directionFromZ(1.0f - 2.0f * u.x, u.y);
      start[lane] = point;
      beta[lane] = Vec3(4.0f * kPi);
      goesOn[lane] = true;
    }
    for (int depth = 0; depth < 200 && std::count(goesOn.begin(), goesOn.end(), true) > 0; ++depth) {
      RayPacket packet;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (goesOn[lane]) packet.set(static_cast<int>(lane), start[lane], direction[lane]);
      transport.rays.intersect(packet, TraceMode::Packet);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (!goesOn[lane]) continue;
        goesOn[lane] = packet.hit(static_cast<int>(lane));
        if (!goesOn[lane]) continue;
        const HitSurface hit = transport.rays.surfaceAt(packet, static_cast<int>(lane));
        light[lane] += beta[lane] * emittedTowardsRay(transport.materials, hit);
        const Vec3 albedo = transport.materials.albedo(hit.point);
        const float survival = std::max({albedo.x, albedo.y, albedo.z});
        goesOn[lane] = next() < survival;
        beta[lane] *= albedo / survival;
        const Vec2 u(next(), next());
        direction[lane] = frameAround(hit.ng).fromLocal(sampleCosineHemisphere(u));
        start[lane] = transport.rays.rayStart(hit);
      }
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::array<float, 4> y = {0.28209479f, 0.48860251f * from[lane].y, 0.48860251f * from[lane].z,
                                      0.48860251f * from[lane].x};
      for (std::size_t k = 0; k < 4; ++k) result.sh[k] += Vec3d(light[lane] * y[k]) / static_cast<double>(paths);
      const auto value = static_cast<double>(luminance(light[lane] * y[0]));
      sum += value / paths;
      squares += value * value / paths;
    }
  }
  result.standardError = std::sqrt((squares - sum * sum) / paths);
  return result;
}

// 100 free points of a lit room, against paths that neither sample lights nor know the cache. Paths of a point scatter
// by some 5% (the lamp is small), the gather by less than 1%: the mean over all points agrees to three standard errors
// of the paths and 0.5% for the cache (texels are 6 cm of a room of 1 m), and the points' deviations are of the size of
// the paths' errors.
TEST(SpacePoints, LitRoomAgreesWithPathTracing) {
  const Asked room(cornell(), {.samples = 512, .adaptive = false});
  const std::vector<Vec3> points = freePoints(Vec3(0.05f), Vec3(0.95f));
  const std::vector<SpaceLight> gathered = room.at(points, {.samples = 1024});
  std::vector<Traced> traced(kPoints);
  parallelFor(kPoints, 1, [&](std::size_t first, std::size_t) {
    traced[first] = tracePaths(room.lit->transport(), points[first], static_cast<std::uint32_t>(first) + 1, 1u << 14);
  });
  double of = 0.0, by = 0.0, variance = 0.0, scores = 0.0, linear = 0.0, linearScale = 0.0;
  std::array<Vec3d, 4> ofMaps{}, byMaps{};
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double a = luminance(gathered[i].sh[0]), b = luminance(Vec3(traced[i].sh[0]));
    of += a / kPoints;
    by += b / kPoints;
    variance += traced[i].standardError * traced[i].standardError / (kPoints * kPoints);
    scores += (a - b) * (a - b) / (traced[i].standardError * traced[i].standardError) / kPoints;
    for (std::size_t k = 0; k < 4; ++k) {
      ofMaps[k] += Vec3d(gathered[i].sh[k]) / double{kPoints};
      byMaps[k] += traced[i].sh[k] / double{kPoints};
      const double d = luminance(gathered[i].sh[k]) - luminance(Vec3(traced[i].sh[k]));
      if (k > 0) linear += d * d / kPoints;
    }
    linearScale += traced[i].standardError * traced[i].standardError / kPoints;
  }
  const double mean = std::sqrt(variance);
  std::printf("gather over paths: %.4f +- %.4f, mean square score %.2f, linear %.2f\n", of / by, mean / by, scores,
              linear / linearScale);
  EXPECT_NEAR(of, by, 3 * mean + 0.005 * by);
  EXPECT_LT(mean, 0.01 * by);  // else the test could not tell
  // 1 if all of it is the paths' noise; of 100 points with heavy tails up to 1.5, and little more by the gather's own.
  EXPECT_LT(scores, 1.6);
  // The squares of the three Y_1m add up to three times that of Y_00.
  EXPECT_LT(linear / linearScale, 3.0 * 1.6);
  // Colour: by channel, in the mean over the points.
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(ofMaps[0][c], byMaps[0][c], 4 * mean + 0.01 * byMaps[0][c]) << c;
  for (std::size_t k = 1; k < 4; ++k)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(ofMaps[k][c], byMaps[k][c], 8 * mean + 0.01 * byMaps[0][c]) << k << c;
}

// Punctual lights have no side to be chosen by: each of two kinds, few and more than are chosen one by one, brings what
// its formula says. Nothing is in the way, and without surfaces around the sum over 40 lights is exact but for their
// choice: 4096 samples leave 1%.
TEST(SpacePoints, PunctualLightsArriveFromAllSides) {
  for (const int lights : {1, 40}) {
    TestScene test;
    test.addRectangle({0, -50, 0}, {1, 0, 0}, {0, 0, -1});
    std::vector<Vec3> points = {{0, 0, 0}, {1, 2, 3}};
    for (int i = 0; i < lights; ++i) {
      Light light;
      light.type = LightType::Point;
      light.intensity = 1.0f + static_cast<float>(i);
      const Vec2 u = sobol2D(static_cast<std::uint32_t>(i), 5);
      light.position = 10.0f * directionFromZ(1.0f - 2.0f * u.x, u.y);
      test.scene.lights.push_back(light);
    }
    const Asked asked(test, {.samples = 16, .bounces = 0});
    const std::vector<SpaceLight> found = asked.at(points, {.samples = 4096});
    for (std::size_t i = 0; i < points.size(); ++i) {
      double expected = 0.0;
      for (const Light& light : test.scene.lights) {
        const Vec3 to = light.position - points[i];
        expected += static_cast<double>(light.intensity / glm::dot(to, to)) * 0.28209479;
      }
      EXPECT_NEAR(static_cast<double>(found[i].sh[0].x), expected, 0.01 * expected) << lights << " lights";
    }
  }
}

// Inside of a closed solid every ray meets a back.
TEST(SpacePoints, BackFacesTellTheInsidesOfSolids) {
  TestScene test;
  test.addRectangle({-1, -1, 5}, {0, 2, 0}, {2, 0, 0}, {.material = test.addMaterial(Vec3(0.5f), Vec3(1.0f))});
  const Vec3 a(-1.0f), x(2, 0, 0), y(0, 2, 0), z(0, 0, 2);
  for (const auto& [corner, right, up] : {std::tuple(a, x, z), std::tuple(a + y, z, x), std::tuple(a, z, y),
                                          std::tuple(a + x, y, z), std::tuple(a, y, x), std::tuple(a + z, x, y)})
    test.addRectangle(corner, right, up);
  const Asked asked(test, {.samples = 64});
  const std::vector<Vec3> points = {{0, 0, 0}, {0.9f, 0.9f, -0.9f}, {0, 0, 3}};
  const std::vector<SpaceLight> found = asked.at(points, {.samples = 256});
  EXPECT_EQ(found[0].backFaces, 1.0f);
  EXPECT_EQ(found[1].backFaces, 1.0f);
  EXPECT_EQ(found[2].backFaces, 0.0f);
  EXPECT_GT(found[2].meanRadiance().x, 0.0f);
}

TEST(SpacePoints, TheSameForAnyNumberOfThreads) {
  const Asked room(cornell(), {.samples = 16});
  const std::vector<Vec3> points = freePoints(Vec3(0.05f), Vec3(0.95f));
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return room.at(points, {.samples = 32});
  };
  const auto one = with(1), four = with(4);
  for (std::size_t i = 0; i < kPoints; ++i) EXPECT_EQ(one[i].sh, four[i].sh);
}

}  // namespace
}  // namespace lumel
