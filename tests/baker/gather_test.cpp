// The final gather against closed forms and against path tracing, and what is particular to its cache: levels of
// bounces, surfaces without texels, texels inside of things.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <set>
#include <utility>

#include "baker/rays/stratified_net.h"
#include "tests/baker/test_scene.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

using namespace testing_scene;

double meanOf(const BakedPage& page) {
  double sum = 0;
  for (int y = 0; y < page.flat.height; ++y)
    for (int x = 0; x < page.flat.width; ++x) sum += static_cast<double>(luminance(page.flat.rgb(x, y)));
  return sum / (page.flat.width * page.flat.height);
}

double meanOf(const BakeResult& result) {
  double sum = 0;
  for (const BakedPage& page : result.pages) sum += meanOf(page) / static_cast<double>(result.pages.size());
  return sum;
}

TEST(StratifiedNet, OnePointInEveryCell) {
  std::array<TexelSampler, kLanes> samplers;
  std::array<bool, kLanes> active{};
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    samplers[lane] = TexelSampler(7, 1, lane, 3);
    active[lane] = lane != 5;
  }
  const auto lanes = std::make_unique<NetLanes>();
  for (int log2Count = 0; log2Count <= 10; ++log2Count)
    for (const std::uint32_t block : {0u, 1u, 5u}) {
      const NetRange range{block << log2Count, log2Count};
      lanes->fill(samplers, active, range, 4);
      const auto columns = static_cast<float>(1 << ((log2Count + 1) / 2));
      const auto rows = static_cast<float>(1 << (log2Count / 2));
      std::array<std::set<std::uint32_t>, kLanes> taken;
      std::set<std::pair<int, int>> cells;
      for (std::uint32_t cell = 0; cell < range.count(); ++cell)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const Vec2 u(lanes->x(cell)[lane], lanes->y(cell)[lane]);
          if (!active[lane]) {
            EXPECT_EQ(u, Vec2(0.0f));
            continue;
          }
          const std::uint32_t sample = lanes->sample(cell, lane);
          ASSERT_GE(sample, range.first);
          ASSERT_LT(sample, range.first + range.count());
          taken[lane].insert(sample);
          EXPECT_EQ(u, samplers[lane].get2D(sample, 4));
          // All lanes take a point of the same cell.
          const std::pair at(static_cast<int>(u.x * columns), static_cast<int>(u.y * rows));
          EXPECT_EQ(cells.insert(at).second, lane == 0) << "cell " << cell << " of " << range.count();
        }
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        EXPECT_EQ(taken[lane].size(), active[lane] ? range.count() : 0u);
    }
}

TEST(StratifiedNet, CoversAnyRange) {
  std::uint32_t next = 3;
  while (next < 1001) {
    const NetRange net = netAt(next, 1001);
    EXPECT_EQ(net.first, next);
    EXPECT_EQ(net.first % net.count(), 0u);
    EXPECT_LE(net.count(), kMostNetPoints);
    next += net.count();
  }
  EXPECT_EQ(next, 1001u);
}

TestScene furnace(float albedo, int texels) {
  TestScene test;
  test.integrator = Integrator::Gather;
  test.addRoom({0, 0, 0}, {1, 1, 1}, {.material = test.addMaterial(Vec3(albedo), Vec3(1.0f)), .texels = texels});
  return test;
}

// In a closed box whose walls emit 1 and reflect a, N bounces bring sum a^k, k = 0..N. Twelve bounces are more than
// the cache has levels.
TEST(Gather, FurnaceHasExactlyTheBouncesAskedFor) {
  for (const float albedo : {0.5f, 0.8f})
    for (const int bounces : {0, 1, 2, 4, 8, 12, 30}) {
      double expected = 0;
      for (int k = 0; k <= bounces; ++k) expected += std::pow(static_cast<double>(albedo), k);
      const BakeResult result = furnace(albedo, 16).bake({.samples = 64, .bounces = bounces});
      // Seeds differ by 0.1% at albedo 0.8, where all share the noise of the cache.
      EXPECT_NEAR(meanOf(result) / expected, 1.0, 4e-3) << "albedo " << albedo << ", " << bounces << " bounces";
      for (const BakedPage& page : result.pages)
        for (const float v : page.flat.pixels) ASSERT_NEAR(v / expected, 1.0, 0.08);
    }
}

TEST(Gather, FurnaceOfAllBounces) {
  for (const float albedo : {0.0f, 0.2f, 0.5f, 0.8f, 0.95f}) {
    const BakeResult result = furnace(albedo, 16).bake({.samples = 64});
    // The warm-up ends where a bounce adds less than 1e-4 of the whole: what is missing is below a / (1 - a) of that,
    // and each pass adds more of it.
    // Noise that all texels share is passed on like light: 0.02% / (1 - a) from seed to seed.
    EXPECT_NEAR(meanOf(result) * (1 - static_cast<double>(albedo)), 1.0,
                2e-3 + 8e-4 / (1 - static_cast<double>(albedo)))
        << "albedo " << albedo;
  }
}

// A room that sends back all light has no finite answer; the bake must end with a finite one.
TEST(Gather, WhiteFurnaceEnds) {
  const BakeResult result = furnace(1.0f, 4).bake({.samples = 64});
  EXPECT_TRUE(std::isfinite(meanOf(result)));
  EXPECT_GT(meanOf(result), 50.0);
}

// Light by reflection alone: flux / area * sum a^k.
TEST(Gather, PointLightEnergyBalance) {
  TestScene test;
  test.integrator = Integrator::Gather;
  test.addRoom({-1, -1, -1}, {1, 1, 1}, {.material = test.addMaterial(Vec3(0.6f)), .texels = 8});
  Light light;
  light.intensity = 2.0f;
  test.scene.lights = {light};
  const double direct = 4 * std::numbers::pi * 2 / 24 / std::numbers::pi;
  for (const int bounces : {0, 1, 3, kAllBounces}) {
    double series = 0;
    for (int k = 0; k <= (bounces < 0 ? 100 : bounces); ++k) series += std::pow(0.6, k);
    // Near hits are shaded, and find the dark of the corners; far ones look up means in which it is counted once more.
    EXPECT_NEAR(meanOf(test.bake({.samples = 128, .adaptive = false, .bounces = bounces})) / (direct * series), 1.0,
                4e-3)
        << bounces;
  }
}

/// Mean of a map over the texels that lie outside of things.
double meanOfValid(const Image& map, const Image& aux) {
  double sum = 0, count = 1e-9;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      if (aux.at(x, y)[1] > 0.5f) {
        sum += static_cast<double>(luminance(map.rgb(x, y)));
        ++count;
      }
  return sum / count;
}

/// Both integrators on a scene: the means of every page, to `tolerance` of them and to 0.3% of the brightest page,
/// which is the noise of a path traced page that light reaches by several bounces alone.
void expectAgreementWithPath(TestScene test, int bounces, double tolerance, int samples, int pathSamples) {
  test.integrator = Integrator::Path;
  const BakeResult path =
      test.bake({.samples = pathSamples, .bounces = bounces, .encoding = rnmEncoding(Projection::Raw)});
  test.integrator = Integrator::Gather;
  const BakeResult gather =
      test.bake({.samples = samples, .bounces = bounces, .encoding = rnmEncoding(Projection::Raw)});
  ASSERT_EQ(path.pages.size(), gather.pages.size());
  double brightest = 0;
  for (const BakedPage& page : path.pages) brightest = std::max(brightest, meanOf(page));
  ASSERT_GT(brightest, 0.0);
  for (std::size_t p = 0; p < path.pages.size(); ++p)
    for (std::size_t i = 0; i < 4; ++i) {
      const auto mean = [&](const BakedPage& page) {
        return meanOfValid(i == 0 ? page.flat : page.maps[i - 1], path.pages[p].aux);
      };
      const double expected = mean(path.pages[p]);
      EXPECT_NEAR(mean(gather.pages[p]), expected, tolerance * expected + 3e-3 * brightest)
          << "page " << p << ", map " << i << ", " << bounces << " bounces";
    }
}

// Every kind of light, a cut-out, instances without texels, backs of single-sided walls; light crosses pages.
// The tolerance is the noise of the path tracer (0.5%) and the cache's stated bias (0.5%).
TEST(Gather, AgreesWithPathTracing) {
  for (const int bounces : {1, 3, kAllBounces}) expectAgreementWithPath(busyRoom(), bounces, 0.01, 256, 2048);
}

/// Two rooms side by side, the left one lit by a lamp, joined by a door in a thick wall. Walls stand on the borders of
/// the floor's texels, so that no texel lies in both rooms.
TestScene twoRooms() {
  TestScene test;
  const int wall = test.addMaterial({0.7f, 0.6f, 0.5f});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(10.0f));
  const RectangleOptions big{.material = wall, .texels = 16};
  test.addRectangle({-4, 0, 4}, {8, 0, 0}, {0, 0, -4}, big);  // floor
  test.addRectangle({-4, 3, 0}, {8, 0, 0}, {0, 0, 4}, big);   // ceiling
  test.addRectangle({-4, 0, 0}, {8, 0, 0}, {0, 3, 0}, big);   // back
  test.addRectangle({4, 0, 4}, {-8, 0, 0}, {0, 3, 0}, big);   // front
  test.addRectangle({-4, 0, 4}, {0, 0, -4}, {0, 3, 0}, big);  // left
  test.addRectangle({4, 0, 0}, {0, 0, 4}, {0, 3, 0}, big);    // right
  const RectangleOptions small{.material = wall, .texels = 8};
  for (const float z : {0.0f, 2.5f}) {                                 // the wall leaves z from 1.5 to 2.5 open
    test.addRectangle({-0.5f, 0, z}, {0, 0, 1.5f}, {0, 3, 0}, small);  // faces -x
    test.addRectangle({0.5f, 0, z + 1.5f}, {0, 0, -1.5f}, {0, 3, 0}, small);
  }
  test.addRectangle({-0.5f, 0, 1.5f}, {1, 0, 0}, {0, 3, 0}, small);
  test.addRectangle({0.5f, 0, 2.5f}, {-1, 0, 0}, {0, 3, 0}, small);
  test.addRectangle({-3, 2.9f, 1}, {1, 0, 0}, {0, 0, 1}, {.material = lamp, .texels = 0});
  return test;
}

TEST(Gather, AgreesWithPathTracingThroughADoor) {
  for (const int bounces : {2, kAllBounces}) expectAgreementWithPath(twoRooms(), bounces, 0.02, 128, 1024);
}

// A corner whose texels are as wide as what stands in it: what a texel shows its neighbours is too coarse, and must not
// be looked up from beside it.
TEST(Gather, CoarseTexelsInCorners) {
  TestScene test;
  const int wall = test.addMaterial(Vec3(0.7f));
  test.addRoom({0, 0, 0}, {1, 1, 1}, {.material = wall, .texels = 3});
  Light light;
  light.intensity = 1.0f;
  light.position = {0.8f, 0.9f, 0.7f};
  test.scene.lights = {light};
  test.integrator = Integrator::Path;
  const BakeResult path = test.bake({.samples = 16384});
  test.integrator = Integrator::Gather;
  const BakeResult gather = test.bake({.samples = 16384});
  double squares = 0, sum = 0, count = 0;
  for (std::size_t p = 0; p < path.pages.size(); ++p)
    for (std::size_t i = 0; i < path.pages[p].flat.pixels.size(); ++i) {
      const double expected = static_cast<double>(path.pages[p].flat.pixels[i]);
      const double difference = static_cast<double>(gather.pages[p].flat.pixels[i]) - expected;
      squares += difference * difference;
      sum += expected;
      ++count;
    }
  // 2.6%, a third of it noise; lookups of all hits on the texels along the edges would make it 4%.
  EXPECT_LT(std::sqrt(squares / count) / (sum / count), 0.03);
}

// A gap narrower than a texel, between a floor and a board over its half: texels there must not look up the light of
// those at its mouth, which is mostly that outside, neither at the first hit nor at a later one.
TEST(Gather, GapsNarrowerThanTexels) {
  TestScene test;
  const int white = test.addMaterial(Vec3(0.8f));
  const int floor = test.addRectangle({0, 0, 4}, {8, 0, 0}, {0, 0, -4}, {.material = white, .texels = 6});
  test.addRectangle({0, 0.2f, 0}, {4, 0, 0}, {0, 0, 4}, {.material = white, .texels = 3});
  test.addRectangle({0, 0.21f, 4}, {4, 0, 0}, {0, 0, -4}, {.material = white, .texels = 3});
  Light light;
  light.intensity = 10.0f;
  light.position = {6.0f, 2.0f, 2.0f};
  test.scene.lights = {light};
  test.integrator = Integrator::Path;
  const Image path = test.bake({.samples = 16384}).pages[static_cast<std::size_t>(floor)].flat;
  test.integrator = Integrator::Gather;
  const auto litOf = [](const Image& flat) {
    double sum = 0;
    for (std::size_t y = 0; y < 6; ++y)
      for (std::size_t x = 0; x < 2; ++x) sum += static_cast<double>(flat.pixels[3 * (6 * y + x)]);
    return sum;
  };
  constexpr int kBakes = 8;
  double lit = 0;
  for (std::uint64_t seed = 1; seed <= kBakes; ++seed)
    lit += litOf(test.bake({.samples = 1024, .seed = seed}).pages[static_cast<std::size_t>(floor)].flat) / kBakes;
  // One bake scatters by 13%, so their mean by 5%. Were rays that go on to look up what they find, it would be 3.6
  // times as much.
  const double expected = litOf(path);
  EXPECT_NEAR(lit, expected, 0.15 * expected);
}

// A mat lies on the floor, half on one texel and half on the next: what the ceiling sees of these texels is their open
// half, not the mean of that and of the dark beneath.
TEST(Gather, TexelsThatThingsLieOn) {
  TestScene test;
  const int white = test.addMaterial(Vec3(0.8f));
  test.addRectangle({0, 0, 6}, {6, 0, 0}, {0, 0, -6}, {.material = white, .texels = 3});
  const int black = test.addMaterial(Vec3(0.0f));
  test.addRectangle({1, 0.01f, 6}, {2, 0, 0}, {0, 0, -6}, {.material = black, .texels = 1});
  test.addRectangle({1, 0.01f, 0}, {2, 0, 0}, {0, 0, 6}, {.material = black, .texels = 1});
  const int ceiling = test.addRectangle({0, 4, 0}, {6, 0, 0}, {0, 0, 6}, {.material = white, .texels = 2});
  Light sun;  // from the side, under the ceiling, so that light is the same all over a texel
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(1.0f, -0.6f, 0.0f));
  test.scene.lights = {sun};
  test.integrator = Integrator::Path;
  const auto lightOf = [&](int samples, std::uint64_t seed) {
    double sum = 0;
    const BakeResult baked = test.bake({.samples = samples, .indirectOnly = true, .seed = seed});
    for (const float value : baked.pages[static_cast<std::size_t>(ceiling)].flat.pixels)
      sum += static_cast<double>(value);
    return sum;
  };
  const double expected = lightOf(65536, 1);
  test.integrator = Integrator::Gather;
  constexpr int kBakes = 16;
  double lit = 0;
  for (std::uint64_t seed = 1; seed <= kBakes; ++seed) lit += lightOf(8192, seed) / kBakes;
  // One bake scatters by 0.8%, so their mean by 0.2%; the means of whole texels would make it 0.76.
  EXPECT_NEAR(lit, expected, 0.01 * expected);
}

// A floor of four texels with a texture of 4096, a quarter of them white at random: the ceiling sees about their mean.
TEST(Gather, TexturesFinerThanTexels) {
  std::vector<Vec4> speckles;
  float whites = 0.0f;
  for (std::uint32_t i = 0; i < 64 * 64; ++i) {
    speckles.emplace_back(Vec3(hashCombine(i, 1) % 4 == 0 ? 1.0f : 0.0f), 1.0f);
    whites += speckles.back().x;
  }
  const auto ceilingOver = [&](bool textured, std::uint64_t seed) {
    TestScene test;
    test.integrator = Integrator::Gather;
    const int material = test.addMaterial(Vec3(textured ? 1.0f : whites / (64 * 64)));
    if (textured)
      test.scene.materials[static_cast<std::size_t>(material)].baseColorMap.image = test.addImage(64, 64, speckles);
    test.addRectangle({0, 0, 4}, {4, 0, 0}, {0, 0, -4}, {.material = material, .texels = 2});
    const int ceiling = test.addRectangle({0, 4, 0}, {4, 0, 0}, {0, 0, 4}, {.texels = 2});
    Light light;
    light.intensity = 10.0f;
    light.position = {2.0f, 3.0f, 2.0f};
    test.scene.lights = {light};
    const BakeResult result = test.bake({.samples = 64, .bounces = 1, .indirectOnly = true, .seed = seed});
    return meanOf(result.pages[static_cast<std::size_t>(ceiling)]);
  };
  double squares = 0.0;
  constexpr int kSeeds = 32;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const double error = ceilingOver(true, seed) / ceilingOver(false, seed) - 1.0;
    squares += error * error / kSeeds;
  }
  // Points of the texture, 16 in each texel: sqrt(3 / 64) = 22%. A quarter of what each stands for: 3.4%.
  EXPECT_LT(std::sqrt(squares), 0.08);
}

// Nothing but the floor has texels: every hit is shaded on the spot, and the bounces asked for are counted exactly.
TEST(Gather, SurfacesWithoutTexels) {
  for (const int bounces : {0, 1, 2, 5}) {
    TestScene test;
    test.integrator = Integrator::Gather;
    const int material = test.addMaterial(Vec3(0.5f), Vec3(1.0f));
    test.addRoom({0, 0, 0}, {1, 1, 1}, {.material = material, .texels = 0});
    const int page =
        test.addRectangle({0.2f, 0.01f, 0.8f}, {0.6f, 0, 0}, {0, 0, -0.6f}, {.material = material, .casts = false});
    double expected = 0;
    for (int k = 0; k <= bounces; ++k) expected += std::pow(0.5, k);
    const double tilted = (1 + 1 / std::sqrt(3.0)) / 2 * expected;
    expectAgreement(deviation(test, {.samples = 256, .bounces = bounces}, page, [&](const Vec3d&) {
      return Maps{expected, tilted, tilted, tilted};
    }));
  }
}

// What the program that shows a scene adds itself is left out, with either integrator, and nothing else.
TEST(Gather, IndirectOnlyIsAllLightLessTheDirect) {
  TestScene test = busyRoom();
  for (const int bounces : {0, 2, kAllBounces}) {
    const auto mean = [&](Integrator integrator, const BakeOptions& options) {
      test.integrator = integrator;
      return meanOf(test.bake(options));
    };
    const BakeOptions all{.samples = 256, .bounces = bounces};
    BakeOptions direct = all, indirect = all;
    direct.bounces = 0;
    indirect.indirectOnly = true;
    // A path takes the same samples, whatever of it counts.
    const double path = mean(Integrator::Path, indirect);
    const double total = mean(Integrator::Path, all);
    EXPECT_NEAR(path, total - mean(Integrator::Path, direct), 1e-5 * total) << bounces;
    // Noise of 256 paths, and the gather's bias.
    EXPECT_NEAR(mean(Integrator::Gather, indirect), path, 0.02 * path) << bounces;
    if (bounces == 0) {
      EXPECT_EQ(path, 0.0);
    } else {
      EXPECT_GT(path, 0.1 * total);
    }
  }
}

TEST(Gather, SameBytesForAnyThreadCount) {
  TestScene test = busyRoom();
  test.integrator = Integrator::Gather;
  for (const int bounces : {3, kAllBounces}) {
    const BakeOptions options{.samples = 48, .bounces = bounces};
    const BakeResult one = test.bake(options, 1);
    EXPECT_GT(one.stats.meanFlat, 0.1);
    EXPECT_TRUE(sameBytes(one, test.bake(options, 2)));
    EXPECT_TRUE(sameBytes(one, test.bake(options, 4)));
  }
}

// A closed room under a sky and a sun that no ray may find.
TEST(Gather, ClosedRoomsStayBlack) {
  TestScene test;
  test.integrator = Integrator::Gather;
  test.addRoom(Vec3(0.1f), Vec3(3.1f), {.material = test.addMaterial(Vec3(0.8f)), .texels = 16});
  test.scene.environment.image = Image(8, 4, 3, 1e6f);
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(1, -2, 0.5f));
  sun.intensity = 1e6f;
  test.scene.lights = {sun};
  EXPECT_EQ(meanOf(test.bake({.samples = 64})), 0.0);
}

// Where nothing shines the rays have validity to find and nothing more.
TEST(Gather, DarkScenesTakeFewSamples) {
  for (const Integrator integrator : {Integrator::Gather, Integrator::Path}) {
    TestScene test;
    test.integrator = integrator;
    const int page = test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
    test.addRectangle({-50, 0.5f, 50}, {100, 0, 0}, {0, 0, -100}, {.texels = 2});  // turns its back to it
    const BakeResult result = test.bake({.samples = 4096, .targetError = 0.01f});
    EXPECT_EQ(meanOf(result), 0.0);
    const float* aux = result.pages[static_cast<std::size_t>(page)].aux.at(1, 1);
    EXPECT_LT(aux[1], 0.3f);
    EXPECT_EQ(aux[3], 8.0f);
  }
}

TEST(Gather, AuxChannelsAndAnySampleCount) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int inside = test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  // A lid that turns its back to the rectangle, single-sided: most gather rays meet a back face.
  test.addRectangle({-50, 0.5f, 50}, {100, 0, 0}, {0, 0, -100}, {.texels = 2});
  test.scene.environment.color = Vec3(1.0f);
  for (const int samples : {1, 2, 3, 17, 100}) {
    const BakeResult result = test.bake({.samples = samples, .adaptive = false, .bounces = 1});
    const float* aux = result.pages[static_cast<std::size_t>(inside)].aux.at(1, 1);
    EXPECT_FLOAT_EQ(aux[0], 1.0f);
    if (samples == 100) {
      EXPECT_LT(aux[1], 0.1f);
    }
    EXPECT_EQ(aux[3], static_cast<float>(samples));
    EXPECT_EQ(result.pages[1].aux.at(0, 0)[1], 1.0f);
  }
}

TEST(Gather, NonFiniteSamplesAreNamed) {
  TestScene test;
  test.integrator = Integrator::Gather;
  test.addRectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, {.texels = 2});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(std::numeric_limits<float>::infinity()));
  test.addRectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {.material = lamp, .texels = 0});
  test.scene.environment.color = Vec3(1.0f);
  const auto result = test.tryBake({.samples = 64, .seed = 5});
  ASSERT_TRUE(result);
  EXPECT_GT(result->stats.nonFiniteSamples, 10u);
  ASSERT_FALSE(result->stats.notes.empty());
  EXPECT_TRUE(mentions(result->stats.notes[0], "page 0, texel ("));
  for (const BakedPage& page : result->pages)
    for (const float v : page.flat.pixels) EXPECT_TRUE(std::isfinite(v));
}

// The reported standard error against the spread from seed to seed. Texels of a wave share one estimate, so this is
// about the whole: root mean squares.
TEST(Gather, StandardErrorIsHonest) {
  for (const int samples : {64, 256}) {
    TestScene test = busyRoom();
    test.integrator = Integrator::Gather;
    constexpr int kRuns = 24;
    std::vector<double> sum(13 * 13), squares(13 * 13);
    double claimed = 0;
    for (int run = 0; run < kRuns; ++run) {
      const BakeResult result = test.bake({.samples = samples, .seed = static_cast<std::uint64_t>(run) + 100});
      const BakedPage& page = result.pages[0];
      for (std::size_t i = 0; i < sum.size(); ++i) {
        const int x = static_cast<int>(i) % 13, y = static_cast<int>(i) / 13;
        const double v = static_cast<double>(luminance(page.flat.rgb(x, y)));
        sum[i] += v;
        squares[i] += v * v;
        claimed += static_cast<double>(page.aux.at(x, y)[2]) * static_cast<double>(page.aux.at(x, y)[2]) / kRuns;
      }
    }
    double truth = 0;
    for (std::size_t i = 0; i < sum.size(); ++i)
      truth += (squares[i] / kRuns - sum[i] * sum[i] / kRuns / kRuns) * kRuns / (kRuns - 1);
    const double ratio = std::sqrt(claimed / truth);
    std::printf("%d samples: claimed / true standard error %.2f\n", samples, ratio);
    // The rate is one for all texels of a bake of some hundred of them.
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, 1.25);
  }
}

TEST(Gather, SamplesUntilTheTargetErrorIsMet) {
  TestScene test = busyRoom();
  test.integrator = Integrator::Gather;
  std::uint64_t raysBefore = 0;
  for (const float target : {0.2f, 0.02f, 0.01f}) {
    const BakeResult result = test.bake({.samples = 32, .targetError = target});
    std::size_t met = 0, texels = 0;
    for (const BakedPage& page : result.pages)
      for (std::size_t i = 0; i < page.aux.pixels.size(); i += 4) {
        const float floor = 0.1f * static_cast<float>(result.stats.meanFlat);
        const float* flat = page.flat.pixels.data() + i / 4 * 3;
        const float light = std::max(floor, luminance({flat[0], flat[1], flat[2]}));
        met += page.aux.pixels[i + 2] <= 1.05f * target * light;  // the floor's mean is over valid texels here
        ++texels;
      }
    EXPECT_GE(static_cast<double>(met), 0.94 * static_cast<double>(texels)) << target;
    EXPECT_GT(result.stats.rays, raysBefore);
    raysBefore = result.stats.rays;
  }
}

/// Root mean square over a page's texels of the difference between two bakes, of the map that differs most, in what is
/// seen of it: the root of light by that of the mean.
double seenDifference(const BakedPage& a, const BakedPage& b, double mean) {
  const std::array<std::pair<const Image*, const Image*>, 4> maps = {
      {{&a.flat, &b.flat}, {&a.maps[0], &b.maps[0]}, {&a.maps[1], &b.maps[1]}, {&a.maps[2], &b.maps[2]}}};
  double worst = 0;
  for (const auto& [one, other] : maps) {
    double sum = 0;
    for (int y = 0; y < one->height; ++y)
      for (int x = 0; x < one->width; ++x) {
        const auto seen = [&](const Image& map) {
          return std::sqrt(std::max(0.0, static_cast<double>(luminance(map.rgb(x, y)))) / mean);
        };
        sum += std::pow(seen(*one) - seen(*other), 2);
      }
    worst = std::max(worst, std::sqrt(sum / (one->width * one->height)));
  }
  return worst;
}

// A floor that a lamp beside a screen lights, one below it whose front end alone sees the lamp, and one below that
// which sees nothing.
TEST(Gather, SamplesGoWhereErrorsAreSeen) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int grey = test.addMaterial(Vec3(0.6f));
  const int lit = test.addRectangle({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, {.material = grey, .texels = 32});
  const int dark = test.addRectangle({-4, -3, 8}, {8, 0, 0}, {0, 0, -12}, {.material = grey, .texels = 32});
  const int night = test.addRectangle({-4, -4, 4}, {8, 0, 0}, {0, 0, -8}, {.material = grey, .texels = 32});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(40.0f));
  test.addRectangle({-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, {.material = lamp, .texels = 0});
  test.addRectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 3}, {.material = grey, .texels = 8});
  const auto page = [](const BakeResult& result, int at) { return result.pages[static_cast<std::size_t>(at)]; };
  const BakeResult truth = test.bake({.samples = 4096, .adaptive = false, .seed = 9});
  const BakeResult all = test.bake({.samples = 256, .adaptive = false});
  const BakeResult some = test.bake({.samples = 256});
  EXPECT_LT(some.stats.rays + some.stats.shadowRays, 0.9 * static_cast<double>(all.stats.rays + all.stats.shadowRays));
  EXPECT_EQ(meanOf(page(some, night)), 0.0);
  for (const int at : {lit, dark}) {
    // Each floor in its own light: eyes adapt to the dark.
    const double mean = meanOf(page(truth, at));
    const double withAll = seenDifference(page(all, at), page(truth, at), mean);
    const double withSome = seenDifference(page(some, at), page(truth, at), mean);
    std::printf("floor %d, light %.2g: error with all samples %.2f%%, with some %.2f%%\n", at, mean, 100 * withAll,
                100 * withSome);
    EXPECT_LT(withSome, 1.1 * withAll + 0.0005) << at;
  }
}

// A bright strip at the far end of a floor, behind a fence, under an even sky: the flat map has settled when the map
// that faces the strip is still far from its light.
TEST(Gather, TheTargetIsMetByEveryMap) {
  TestScene test;
  test.integrator = Integrator::Gather;
  test.addRectangle({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, {.material = test.addMaterial(Vec3(0.3f)), .texels = 16});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(30.0f));
  test.addRectangle({-4, 0.5f, -8}, {8, 0, 0}, {0, 0.5f, 0}, {.material = lamp, .texels = 0});
  for (float x = -4; x < 4; x += 1)
    test.addRectangle({x, 0, -4.5f}, {0.5f, 0, 0}, {0, 1, 0}, {.material = test.addMaterial(Vec3(0.0f)), .texels = 0});
  test.scene.environment.color = Vec3(1.0f);
  const float target = 0.02f;
  const BakedPage truth = test.bake({.samples = 8192, .adaptive = false, .seed = 9}).pages[0];
  const BakedPage page = test.bake({.samples = 32, .targetError = target}).pages[0];
  std::size_t within = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      for (std::size_t k = 0; k < 3; ++k)
        within += std::abs(luminance(page.maps[k].rgb(x, y)) - luminance(truth.maps[k].rgb(x, y))) <=
                  1.96f * target * luminance(truth.flat.rgb(x, y));
  const double share = static_cast<double>(within) / (3 * 16 * 16);
  std::printf("within 1.96 times the target: %.1f%%\n", 100 * share);
  EXPECT_GE(share, 0.95);
}

TEST(Gather, Interrupted) {
  struct Stop : Progress {
    bool cancelled() const override { return true; }
  };
  const TestScene test = busyRoom();
  Stop stop;
  const auto result = lumel::bake(test.scene, test.atlas, findTexels(test.atlas), {.samples = 4}, stop);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Interrupted);
}

}  // namespace
}  // namespace lumel
