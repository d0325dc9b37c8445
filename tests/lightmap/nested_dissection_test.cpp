#include "lightmap/charts/nested_dissection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace lumel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct Grid {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

  explicit Grid(std::uint32_t cells) {
    const std::uint32_t width = cells + 1;
    for (std::uint32_t y = 0; y < width; ++y)
      for (std::uint32_t x = 0; x < width; ++x) points.push_back(Vec3d(x, y, 0.01 * x * y));
    for (std::uint32_t y = 0; y < cells; ++y)
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = y * width + x;
        triangles.push_back({a, a + 1, a + width + 1});
        triangles.push_back({a, a + width + 1, a + width});
      }
  }
};

/// Entries of a factor below the diagonal: eliminating a point joins its neighbours that are left with each other.
std::size_t fillOf(const Grid& grid, const std::vector<std::uint32_t>& order) {
  std::vector<std::uint32_t> rank(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  std::vector<std::set<std::uint32_t>> later(order.size());
  for (const Triangle& t : grid.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = rank[t[k]], b = rank[t[(k + 1) % 3]];
      later[std::min(a, b)].insert(std::max(a, b));
    }
  std::size_t entries = 0;
  for (const std::set<std::uint32_t>& column : later) {
    entries += column.size();
    if (column.size() < 2) continue;
    const std::uint32_t parent = *column.begin();
    later[parent].insert(std::next(column.begin()), column.end());
  }
  return entries;
}

TEST(NestedDissection, IsAnOrderOfAllPointsWithFarLessFillThanTheirOwn) {
  const Grid grid(48);
  const std::vector<std::uint32_t> order = nestedDissection(grid.points, grid.triangles).order;
  std::vector<std::uint32_t> own(grid.points.size());
  for (std::uint32_t i = 0; i < own.size(); ++i) own[i] = i;
  std::vector<std::uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, own);
  // n log2 n is 27 thousand; row by row a band of 49 fills: 117 thousand.
  EXPECT_LT(fillOf(grid, order), 2 * 27000u);
  EXPECT_GT(fillOf(grid, own), 100000u);
}

TEST(NestedDissection, OfPointsInOnePlaceOrNoneEnds) {
  const Grid grid(8);
  const std::vector<Vec3d> same(grid.points.size(), Vec3d(1, 2, 3));
  std::vector<std::uint32_t> order = nestedDissection(same, grid.triangles).order;
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order.back() + 1, same.size());
  EXPECT_EQ(nestedDissection(std::vector<Vec3d>(1), {}).order, std::vector<std::uint32_t>{0});
  EXPECT_TRUE(nestedDissection({}, {}).nodes.empty());
}

}  // namespace
}  // namespace lumel
