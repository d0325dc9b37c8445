// Places that share no light: each must be as good as if it were alone, however bright the others are and wherever its
// texels lie on the page.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <vector>

#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr int kTexels = 8;  // on a side of each wall
constexpr int kGap = 2;
constexpr int kCell = kTexels + kGap;
constexpr std::size_t kWalls = 6;
constexpr float kAlbedo = 0.6f;

/// Puts all rectangles, of kTexels each, on one page side by side.
void putOnOnePage(TestScene& test) {
  const int across = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(test.atlas.surfaces.size()))));
  for (int i = 0; i < static_cast<int>(test.atlas.surfaces.size()); ++i) {
    Surface& surface = test.atlas.surfaces[static_cast<std::size_t>(i)];
    surface.page = 0;
    const Vec2 corner(i % across * kCell + 1, i / across * kCell + 1);
    for (Vec2& uv : surface.lightmapUvs)
      uv = (corner + uv * static_cast<float>(kTexels)) / static_cast<float>(across * kCell);
  }
  test.atlas.pages.assign(1, {across * kCell, across * kCell});
}

struct Texel {
  double light = 0.0, error = 0.0, samples = 0.0;
};

/// The texels of `rectangles` from rectangle `first` on, after putOnOnePage.
std::vector<Texel> texelsOf(const BakeResult& result, std::size_t first, std::size_t rectangles = kWalls) {
  const BakedPage& page = result.pages.front();
  const int across = page.flat.width / kCell;
  std::vector<Texel> texels;
  for (int r = static_cast<int>(first); r < static_cast<int>(first + rectangles); ++r)
    for (int i = 0; i < kTexels * kTexels; ++i) {
      const int x = r % across * kCell + 1 + i % kTexels, y = r / across * kCell + 1 + i / kTexels;
      const float* aux = page.aux.at(x, y);
      EXPECT_FLOAT_EQ(aux[0], 1.0f);
      texels.push_back({static_cast<double>(luminance(page.flat.rgb(x, y))), static_cast<double>(aux[2]),
                        static_cast<double>(aux[3])});
    }
  return texels;
}

/// How the light of a room compares with what is right.
struct Judged {
  double mean = 0.0;     // of the right one
  double error = 0.0;    // root mean square of relative errors
  double stated = 0.0;   // the same of standard errors
  double within = 0.0;   // share of texels within 1.96 standard errors
  double samples = 0.0;  // per texel
};

/// `scale`: of the truth.
Judged judge(std::span<const Texel> room, std::span<const Texel> truth, double scale = 1.0) {
  Judged judged;
  double light = 0.0, right = 0.0;
  const auto count = static_cast<double>(room.size());
  for (std::size_t i = 0; i < room.size(); ++i) {
    const double expected = scale * truth[i].light, off = room[i].light - expected;
    light += room[i].light;
    right += expected;
    judged.error += std::pow(off / expected, 2) / count;
    judged.stated += std::pow(room[i].error / expected, 2) / count;
    judged.within += (std::abs(off) <= 1.96 * room[i].error ? 1.0 : 0.0) / count;
    judged.samples += room[i].samples / count;
  }
  judged.mean = light / right;
  judged.error = std::sqrt(judged.error);
  judged.stated = std::sqrt(judged.stated);
  return judged;
}

/// `range`: 0: none.
void addLamp(TestScene& test, const Vec3& position, double candelas, float range) {
  Light lamp;
  lamp.range = range;
  lamp.position = position;
  lamp.intensity = static_cast<float>(candelas);
  test.scene.lights.push_back(lamp);
}

/// Closed rooms of 2 x 2 x 2 m in a row, a lamp of so many candelas in each.
TestScene hotel(std::span<const double> lamps, float range) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int wall = test.addMaterial(Vec3(kAlbedo));
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const float x = 6.0f * static_cast<float>(i);
    test.addRoom({x, 0, 0}, {x + 2, 2, 2}, {.material = wall, .texels = kTexels});
    addLamp(test, {x + 1, 1.2f, 0.8f}, lamps[i], range);
  }
  putOnOnePage(test);
  return test;
}

/// A room of one candela by itself.
std::vector<Texel> roomAlone(float range) {
  const std::vector<double> one(1, 1.0);
  std::vector<Texel> truth = texelsOf(hotel(one, range).bake({.samples = 8192, .adaptive = false, .seed = 99}), 0);
  double mean = 0.0;
  for (const Texel& texel : truth) mean += texel.light / static_cast<double>(truth.size());
  // A flux of 4 pi lm on 24 m2 that keep 1 - albedo of it; 1% for the cache, which takes light for constant over a
  // texel, in corners too.
  if (range == 0.0f) {
    EXPECT_NEAR(mean * 24.0 * (1.0 - static_cast<double>(kAlbedo)) / 4.0, 1.0, 0.01);
  }
  return truth;
}

/// A closed room as in the hotel under a field of 400 m2 with a sun of so many lux on it.
TestScene cellar(float lux) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int wall = test.addMaterial(Vec3(kAlbedo));
  test.addRoom({0, 0, 0}, {2, 2, 2}, {.material = wall, .texels = kTexels});
  for (int i = 0; i < 16; ++i)
    test.addRectangle({-9.0f + static_cast<float>(i % 4) * 5, 2.5f, -4.0f + static_cast<float>(i / 4) * 5}, {5, 0, 0},
                      {0, 0, -5}, {.material = wall, .texels = kTexels});
  addLamp(test, {1, 1.2f, 0.8f}, 1.0, 0.0f);
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(0.3f, -1.0f, 0.2f));
  sun.intensity = lux;
  if (lux > 0.0f) test.scene.lights.push_back(sun);
  putOnOnePage(test);
  return test;
}

/// Of intervals that hold for 95% of texels, for 384 texels whose errors share waves.
void expectHonest(const Judged& room) {
  EXPECT_GT(room.within, 0.82);
  EXPECT_LT(room.error, 1.5 * room.stated);
}

void print(const char* what, const Judged& j) {
  std::printf("%s: mean %.4f of right, error %.2f%%, stated %.2f%%, within %.1f%%, samples %.0f\n", what, j.mean,
              100 * j.error, 100 * j.stated, 100 * j.within, j.samples);
}

TEST(SeparatePlaces, TheSunAboveChangesNothingInACellar) {
  const std::vector<Texel> truth = roomAlone(0.0f);
  for (const BakeOptions& options : {BakeOptions{.samples = 256, .adaptive = false}, BakeOptions{.samples = 256},
                                     BakeOptions{.samples = 32, .targetError = 0.02f}}) {
    const Judged without = judge(texelsOf(cellar(0.0f).bake(options), 0), truth);
    const Judged with = judge(texelsOf(cellar(1e6f).bake(options), 0), truth);
    print("without the sun", without);
    print("with the sun", with);
    EXPECT_NEAR(with.mean / without.mean, 1.0, 0.01);
    // Waves that hold texels of the field, too, waste samples on the sun.
    EXPECT_LT(with.error, 2.0 * without.error);
    expectHonest(with);
  }
}

/// Rooms with lamps of 1 to 1e5 candelas, in no order, against a room by itself.
void expectEachAsIfAlone(int rooms, float range) {
  const std::vector<Texel> truth = roomAlone(range);
  std::vector<double> lamps;
  for (int i = 0; i < rooms; ++i) lamps.push_back(std::pow(10.0, 5.0 * (i * 7 % rooms) / (rooms - 1)));
  for (const BakeOptions& options : {BakeOptions{.samples = 128, .adaptive = false}, BakeOptions{.samples = 128},
                                     BakeOptions{.samples = 32, .targetError = 0.02f}}) {
    const std::vector<double> one(1, 1.0);
    const Judged alone = judge(texelsOf(hotel(one, range).bake(options), 0), truth);
    print("alone", alone);
    const BakeResult baked = hotel(lamps, range).bake(options);
    Judged worst = alone;
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      const Judged room = judge(texelsOf(baked, kWalls * i), truth, lamps[i]);
      SCOPED_TRACE(lamps[i]);
      EXPECT_NEAR(room.mean, 1.0, 0.01);
      // Lamps behind walls are looked for all the same, and means of 384 texels vary by a tenth from room to room.
      EXPECT_LT(room.error, 2.0 * alone.error);
      expectHonest(room);
      if (room.error > worst.error) worst = room;
    }
    print("the worst of all rooms", worst);
  }
}

// A lamp's range of 4 m keeps it from being chosen in other rooms.
TEST(SeparatePlaces, FiftyRoomsOfAHotelAreEachAsIfAlone) { expectEachAsIfAlone(50, 4.0f); }

TEST(SeparatePlaces, LampsWithoutARangeShineOnOtherRoomsInVain) { expectEachAsIfAlone(8, 0.0f); }

}  // namespace
}  // namespace lumel
