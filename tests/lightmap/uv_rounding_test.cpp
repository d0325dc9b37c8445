#include "lightmap/atlas/uv_rounding.h"

#include <gtest/gtest.h>

namespace lumel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
constexpr Vec2d kPage(1024, 1024);

/// Exact for floats of 0..1; positive where counter-clockwise as seen, v down.
double area(const std::vector<Vec2>& uvs, const Triangle& t) {
  const Vec2d a = Vec2d(uvs[t[1]]) - Vec2d(uvs[t[0]]), b = Vec2d(uvs[t[2]]) - Vec2d(uvs[t[0]]);
  return a.y * b.x - a.x * b.y;
}

/// A square above a long edge, and below it a fan of slivers from the edge's left end over points on the edge.
struct Wall {
  std::vector<Vec2> uvs;
  std::vector<Triangle> triangles;

  explicit Wall(std::uint32_t points) {
    for (std::uint32_t i = 0; i < points; ++i) {  // along the edge: exactly on a line, so the fan has no area
      const float s = static_cast<float>(i) / static_cast<float>(points - 1);
      uvs.push_back({0.5f + 0.25f * s, 0.5f + 0.25f * s});
    }
    uvs.push_back({0.75f, 0.5f});
    for (std::uint32_t i = 0; i + 1 < points; ++i) triangles.push_back({points, i, i + 1});
    for (std::uint32_t i = 1; i + 1 < points; ++i) triangles.push_back({0, i + 1, i});
  }
};

TEST(UvRounding, GivesAFanOfLostSliversTheirAreaBack) {
  for (const std::uint32_t points : {3u, 5u, 9u}) {
    Wall wall(points);
    const std::vector<Vec2> before = wall.uvs;
    int lost = 0;
    for (const Triangle& t : wall.triangles) lost += !(area(before, t) > 0);
    ASSERT_EQ(lost, static_cast<int>(points) - 2);
    keepAreasAfterRounding(wall.uvs, wall.triangles, kPage);
    for (const Triangle& t : wall.triangles) EXPECT_GT(area(wall.uvs, t), 0);
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_LE(glm::length(Vec2d(wall.uvs[i]) - Vec2d(before[i])) * kPage.x, 1e-3);
  }
}

TEST(UvRounding, TurnsASliverBackThatRoundingTurnedOver) {
  const float step = 1.0f / (1 << 24);
  std::vector<Vec2> uvs = {{0.5f, 0.5f}, {0.75f, 0.5f}, {0.6f, 0.5f + 2 * step}};
  const std::vector<Triangle> triangles = {{0, 1, 2}};
  ASSERT_LT(area(uvs, triangles[0]), 0);
  keepAreasAfterRounding(uvs, triangles, kPage);
  EXPECT_GT(area(uvs, triangles[0]), 0);
}

TEST(UvRounding, LeavesSoundChartsAndHopelessOnesAlone) {
  std::vector<Vec2> sound = {{0.5f, 0.75f}, {0.75f, 0.75f}, {0.75f, 0.5f}};
  const std::vector<Vec2> before = sound;
  keepAreasAfterRounding(sound, std::vector<Triangle>{{0, 1, 2}}, kPage);
  EXPECT_EQ(sound, before);
  // Turned over by a quarter of the page: nothing that a thousandth of a texel could mend.
  keepAreasAfterRounding(sound, std::vector<Triangle>{{0, 2, 1}}, kPage);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LE(glm::length(Vec2d(sound[i]) - Vec2d(before[i])) * kPage.x, 1e-3);
  std::vector<Vec2> none;
  keepAreasAfterRounding(none, std::vector<Triangle>{}, kPage);
}

}  // namespace
}  // namespace lumel
