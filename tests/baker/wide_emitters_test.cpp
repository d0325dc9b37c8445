// Where everything shines a little: rays find that light, light samples look for lamps alone.
#include <gtest/gtest.h>

#include <cmath>

#include "baker/light/lit_scene.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr float kFaint = 0.1f;
constexpr float kLamp = 50.0f;

/// A rectangle as tiles x tiles rectangles.
void addTiles(TestScene& test, const Vec3& corner, const Vec3& right, const Vec3& up, int tiles,
              const RectangleOptions& options) {
  const float width = 1.0f / static_cast<float>(tiles);
  for (int y = 0; y < tiles; ++y)
    for (int x = 0; x < tiles; ++x)
      test.addRectangle(corner + static_cast<float>(x) * width * right + static_cast<float>(y) * width * up,
                        width * right, width * up, options);
}

/// The walls and the ceiling of a box, which face into it.
void addWallsAndCeiling(TestScene& test, const Vec3& min, const Vec3& size, int tiles,
                        const RectangleOptions& options) {
  const Vec3 x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
  addTiles(test, min, y, z, tiles, options);
  addTiles(test, min + x, z, y, tiles, options);
  addTiles(test, min, z, x, tiles, options);
  addTiles(test, min + y, x, z, tiles, options);
  addTiles(test, min + z, y, x, tiles, options);
}

std::vector<Vec3d> cornersOf(const Vec3d& corner, const Vec3d& right, const Vec3d& up) {
  return {corner, corner + right, corner + right + up, corner + up};
}

/// Black rooms whose light is known. In the first, walls and ceiling shine faintly and a lamp hangs; the other, far
/// above so that the choice of lamps prefers its own, is dark but for a tile that shines as faintly.
struct FaintRooms {
  TestScene test;
  int floor = 0, otherFloor = 0;
  std::vector<Vec3d> lamp = cornersOf({0.45, 0.45, 0.6}, {0, 0.1, 0}, {0.1, 0, 0});
  std::vector<Vec3d> tile = cornersOf({0.48, 0.48, 60.9}, {0, 0.04, 0}, {0.04, 0, 0});

  FaintRooms() {
    const int black = test.addMaterial(Vec3(0.0f));
    const int faint = test.addMaterial(Vec3(0.0f), Vec3(kFaint));
    floor = test.addRectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {.material = black, .texels = 8});
    addWallsAndCeiling(test, {0, 0, 0}, {1, 1, 1}, 8, {.material = faint, .texels = 0});
    test.addRectangle({0.45f, 0.45f, 0.6f}, {0, 0.1f, 0}, {0.1f, 0, 0},
                      {.material = test.addMaterial(Vec3(0.0f), Vec3(kLamp)), .texels = 0});
    otherFloor = test.addRectangle({0, 0, 60}, {1, 0, 0}, {0, 1, 0}, {.material = black, .texels = 8});
    addWallsAndCeiling(test, {0, 0, 60}, {1, 1, 1}, 1, {.material = black, .texels = 0});
    test.addRectangle({0.48f, 0.48f, 60.9f}, {0, 0.04f, 0}, {0.04f, 0, 0}, {.material = faint, .texels = 0});
  }

  Maps onFloor(const Vec3d& p) const {
    Maps maps;
    for (int i = 0; i < 4; ++i) {
      const double open = i == 0 ? 1.0 : 0.5 * (1.0 + 1.0 / std::sqrt(3.0));  // light of an even sky
      maps[static_cast<std::size_t>(i)] =
          kFaint * open + (kLamp - kFaint) * polygonLight(p, {0, 0, 1}, axisInWorld(test, floor, i - 1), lamp);
    }
    return maps;
  }
  Maps onOtherFloor(const Vec3d& p) const {
    Maps maps;
    for (int i = 0; i < 4; ++i)
      maps[static_cast<std::size_t>(i)] =
          kFaint * polygonLight(p, {0, 0, 1}, axisInWorld(test, otherFloor, i - 1), tile);
    return maps;
  }
};

TEST(WideEmitters, BothIntegratorsAgreeWithClosedForms) {
  FaintRooms rooms;
  for (const Integrator integrator : {Integrator::Gather, Integrator::Path}) {
    rooms.test.integrator = integrator;
    BakeOptions options;
    options.samples = 64;
    options.bounces = 1;
    SCOPED_TRACE(integrator == Integrator::Gather ? "gather" : "path");
    expectAgreement(deviation(rooms.test, options, rooms.floor, [&](const Vec3d& p) { return rooms.onFloor(p); }));
    // Rays alone meet the tile of 16 square centimetres so seldom that the error of 8 bakes would be 4%.
    expectAgreement(
        deviation(rooms.test, options, rooms.otherFloor, [&](const Vec3d& p) { return rooms.onOtherFloor(p); }));
  }
}

TEST(WideEmitters, AreVeryManyOfAboutTheSameRadiance) {
  FaintRooms rooms;
  const auto lit = LitScene::build(rooms.test.scene, true);
  ASSERT_TRUE(lit);
  const LightTransport& transport = (*lit)->transport();
  ASSERT_TRUE(transport.emissive.hasWide());
  // Where they are left out, a hit on one counts fully, and one on the lamp as before among the few that are left.
  const auto hitFrom = [&](const Vec3& p, const Vec3& direction) {
    RayPacket packet;
    packet.set(0, p, direction);
    transport.rays.intersect(packet, TraceMode::Packet);
    EXPECT_TRUE(packet.hit(0));
    return transport.rays.surfaceAt(packet, 0);
  };
  const Vec3 p(0.47f, 0.52f, 0.2f);
  const HitSurface wall = hitFrom(p, {-1, 0, 0.1f}), lamp = hitFrom(p, {0, 0, 1});
  EXPECT_TRUE(transport.emissive.isWide(wall));
  EXPECT_FALSE(transport.emissive.isWide(lamp));
  EXPECT_GT(transport.emissive.pdf(wall, p, Emitters::All), 0.0f);
  EXPECT_EQ(transport.emissive.pdf(wall, p, Emitters::WithoutWide), 0.0f);
  EXPECT_GT(transport.emissive.pdf(lamp, p, Emitters::WithoutWide), transport.emissive.pdf(lamp, p, Emitters::All));

  TestScene few;
  few.addRoom({0, 0, 0}, {1, 1, 1}, {.material = few.addMaterial(Vec3(0.5f), Vec3(kFaint)), .texels = 0});
  const auto litByFew = LitScene::build(few.scene, true);
  ASSERT_TRUE(litByFew);
  EXPECT_FALSE((*litByFew)->transport().emissive.hasWide());
}

// In a furnace nothing is left to look for.
TEST(WideEmitters, CostNoLightSamplesWhereTheyAreAllThatIsSeen) {
  TestScene test;
  test.integrator = Integrator::Gather;
  const RectangleOptions shining{.material = test.addMaterial(Vec3(0.5f), Vec3(1.0f)), .texels = 2};
  addWallsAndCeiling(test, {0, 0, 0}, {1, 1, 1}, 6, shining);
  addTiles(test, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 6, shining);
  BakeOptions options;
  options.samples = 16;
  options.bounces = 1;
  const BakeResult result = test.bake(options);
  double mean = 0.0;
  for (const BakedPage& page : result.pages)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 2; ++x) mean += static_cast<double>(page.flat.rgb(x, y).x) / (4.0 * 216);
  EXPECT_EQ(result.stats.shadowRays, 0u);
  // Of one texel 5% (gather rays do not follow the cosine); of the mean of 864 texels 0.2%.
  EXPECT_NEAR(mean, 1.5, 0.01);
}

}  // namespace
}  // namespace lumel
