#include "baker/gather/waves/texel_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "scene/base/sobol.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

struct Mapped {
  std::vector<std::string> notes;
  Materials materials;
  std::unique_ptr<RayScene> rays;
  std::vector<PageTexels> texels;
  std::unique_ptr<TexelMap> map;

  explicit Mapped(const TestScene& test) : materials(test.scene, true, notes), texels(findTexels(test.atlas)) {
    auto built = RayScene::build(test.scene, materials, 0);
    EXPECT_TRUE(built);
    rays = *std::move(built);
    map = std::make_unique<TexelMap>(*rays, test.atlas, texels);
  }
  std::uint32_t texelAt(std::size_t page, int x, int y) const {
    for (std::size_t i = 0; i < texels[page].size(); ++i)
      if (texels[page].coords[i].x == x && texels[page].coords[i].y == y)
        return map->firstOfPage(page) + static_cast<std::uint32_t>(i);
    return kNoTexel;
  }
};

// Pages whose sides are no multiples of a tile, the second with half of its texels; from above, from below and past.
void expectTexelsUnderHits(bool placedByEmbree) {
  TestScene test;
  test.addRectangle({0, 0, 0}, {0, 0, 10}, {10, 0, 0}, {.texels = 10});              // faces +y
  test.addRectangle({20, 0, 0}, {0, 0, 7}, {7, 0, 0}, {.texels = 7, .flip = true});  // mirrored
  test.atlas.surfaces[1].indices.resize(3);
  test.atlas.surfaces[1].sourceTriangle.resize(1);
  test.atlas.surfaces[1].charts.resize(1);
  test.addRectangle({40, 0, 0}, {0, 0, 5}, {5, 0, 0}, {.texels = 0});
  if (placedByEmbree)
    for (const int instance : {0, 1, 2}) test.addInstance(instance, glm::translate(Mat4(1.0f), Vec3(0, 0, 1000)));
  const Mapped mapped(test);
  ASSERT_EQ(mapped.rays->placesInstances(), placedByEmbree);
  ASSERT_LT(mapped.texels[1].size(), 40u);
  std::vector<std::uint8_t> uneven(mapped.map->size());
  for (std::size_t t = 0; t < uneven.size(); t += 3) uneven[t] = 1;
  mapped.map->setUneven(uneven);
  std::map<std::string, int> seen;
  for (std::uint32_t p = 0; p < 200; ++p) {
    RayPacket packet;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (lane == 5) continue;
      const Vec2 u = sobol2D(p * kLanes + static_cast<std::uint32_t>(lane), 1);
      const float height = lane % 4 == 3 ? -3.0f : 3.0f;
      packet.set(lane, {50.0f * u.x, height, 10.0f * u.y}, {0, -height, 0});
    }
    mapped.rays->intersect(packet, TraceMode::Packet);
    TexelMap::Lookup lookup;
    mapped.map->findAll(packet, lookup);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t found = lookup.texels[static_cast<std::size_t>(lane)];
      std::uint32_t expected = kNoTexel;
      if (packet.hit(lane)) {
        const float x = packet.rayhit.ray.org_x[lane], z = packet.rayhit.ray.org_z[lane];
        const std::size_t page = x < 15 ? 0 : 1;
        const float side = page == 0 ? 10.0f : 7.0f, along = page == 0 ? x : x - 20.0f;
        const float edge =
            std::min({std::abs(z - std::round(z)), std::abs(along - std::round(along)), std::abs(along - z)});
        if (edge < 1e-3f) continue;  // rounding decides
        const bool lies = x < 30 && (page == 0 || z > along);
        const bool isBack = lane % 4 == 3;
        if (lies) expected = mapped.texelAt(page, static_cast<int>(z), static_cast<int>(side - along));
        ASSERT_TRUE(!lies || expected != kNoTexel);
        ++seen[isBack ? "back" : lies ? (page == 0 ? "first" : "second") : "none"];
        EXPECT_EQ((lookup.behind >> lane & 1u) != 0, isBack) << "packet " << p << " lane " << lane;
        // A triangle without places beside one that has them tells by its missing texel alone.
        if (page == 0 || x > 30) {
          EXPECT_EQ((lookup.others >> lane & 1u) != 0, isBack || !lies);
        }
      } else {
        ++seen["miss"];
        EXPECT_EQ((lookup.behind | lookup.others | lookup.near) >> lane & 1u, 0u);
      }
      const bool tellsAll = found != kNoTexel && (lookup.others >> lane & 1u) == 0;
      EXPECT_EQ(lookup.uneven >> lane & 1u, tellsAll && uneven[found] ? 1u : 0u) << "packet " << p << " lane " << lane;
      EXPECT_EQ(found, expected) << "packet " << p << " lane " << lane;
    }
  }
  for (const char* kind : {"first", "second", "back", "none", "miss"}) EXPECT_GT(seen[kind], 20) << kind;
}

TEST(TexelMap, FindsTheTexelUnderAHit) { expectTexelsUnderHits(false); }
TEST(TexelMap, FindsTheTexelUnderAHitOnAnInstance) { expectTexelsUnderHits(true); }

TEST(TexelMap, SubstitutesAreTheNearestOfTheChart) {
  TestScene test;
  test.addRectangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {.texels = 50});
  test.addRectangle({2, 0, 0}, {0, 0, 1}, {1, 0, 0}, {.texels = 6});
  const Mapped mapped(test);
  std::vector<std::uint8_t> valid(mapped.map->size(), 0);
  const std::array<TexelCoord, 4> sources = {{{3, 5}, {4, 5}, {13, 2}, {41, 46}}};
  for (const TexelCoord& c : sources) valid[mapped.texelAt(0, c.x, c.y)] = 1;
  std::vector<std::uint8_t> wanting(mapped.map->size(), 1);
  wanting[mapped.texelAt(0, 3, 6)] = 0;
  const auto found = mapped.map->substitutes(wanting, valid);
  std::map<std::uint32_t, std::uint32_t> sourceOf;
  for (const TexelMap::Substitute& s : found) sourceOf[s.texel] = s.source;
  std::size_t expected = 0;
  for (std::uint32_t t = 0; t < mapped.texels[0].size(); ++t) {
    const TexelCoord at = mapped.texels[0].coords[t];
    int least = 1 << 20;
    for (const TexelCoord& c : sources)
      if (std::max(std::abs(c.x - at.x), std::abs(c.y - at.y)) <= TexelMap::kReach)
        least = std::min(least, (c.x - at.x) * (c.x - at.x) + (c.y - at.y) * (c.y - at.y));
    if (least == 0 || least == 1 << 20 || !wanting[t]) continue;
    ++expected;
    ASSERT_TRUE(sourceOf.contains(t)) << at.x << ", " << at.y;
    const TexelCoord c = mapped.texels[0].coords[sourceOf[t]];
    EXPECT_TRUE(valid[sourceOf[t]]);
    EXPECT_EQ((c.x - at.x) * (c.x - at.x) + (c.y - at.y) * (c.y - at.y), least) << at.x << ", " << at.y;
  }
  EXPECT_GT(expected, 500u);
  EXPECT_EQ(found.size(), expected);  // none of the page without a valid texel, none out of reach
}

}  // namespace
}  // namespace lumel
