#include "lightmap/pack/pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lightmap/pack/pack_shape.h"
#include "scene/base/parallel.h"
#include "scene/base/stopwatch.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

using Triangle = std::array<Vec2, 3>;

PackShape rectangle(float width, float height, Vec2 at = Vec2(0)) {
  const Vec2 a = at, b = at + Vec2(width, 0), c = at + Vec2(width, height), d = at + Vec2(0, height);
  return {{Triangle{a, b, c}, Triangle{a, c, d}}, 0, true};
}

PackShape ell(float size, float thickness) {
  PackShape shape = rectangle(size, thickness);
  const PackShape leg = rectangle(thickness, size - thickness, Vec2(0, thickness));
  shape.triangles.insert(shape.triangles.end(), leg.triangles.begin(), leg.triangles.end());
  return shape;
}

/// A fan about a centre, of random radii: star-shaped, often concave.
PackShape randomStar(std::mt19937& random, float meanRadius) {
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  const int corners = 3 + static_cast<int>(uniform(random) * 9);
  const Vec2 centre(1000.0f * uniform(random), -500.0f * uniform(random));
  std::vector<Vec2> ring;
  for (int i = 0; i < corners; ++i) {
    const float angle = 2 * kPi * static_cast<float>(i) / static_cast<float>(corners);
    ring.push_back(centre + meanRadius * (0.2f + 1.6f * uniform(random)) * Vec2(std::cos(angle), std::sin(angle)));
  }
  PackShape shape;
  for (int i = 0; i < corners; ++i)
    shape.triangles.push_back(
        {centre, ring[static_cast<std::size_t>(i)], ring[static_cast<std::size_t>((i + 1) % corners)]});
  return shape;
}

std::vector<PackShape> randomStars(std::size_t count, float meanRadius, unsigned seed) {
  std::mt19937 random(seed);
  std::lognormal_distribution<float> radius(std::log(meanRadius), 0.8f);
  std::vector<PackShape> shapes;
  for (std::size_t i = 0; i < count; ++i) {
    shapes.push_back(randomStar(random, std::min(30.0f, radius(random))));
    shapes.back().group = static_cast<std::uint32_t>(i % 7);
    shapes.back().mayRotate = i % 3 != 0;
  }
  return shapes;
}

/// Area shared by a triangle and the unit square at (x, y), by clipping: independent of the packer's rasteriser.
double overlapArea(const Triangle& triangle, int x, int y) {
  std::vector<Vec2d> polygon = {Vec2d(triangle[0]), Vec2d(triangle[1]), Vec2d(triangle[2])};
  const auto clip = [&](int axis, double limit, double sign) {
    std::vector<Vec2d> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2d a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
      if (da >= 0) kept.push_back(a);
      if ((da < 0) != (db < 0)) kept.push_back(a + (b - a) * (da / (da - db)));
    }
    polygon = kept;
  };
  clip(0, x, 1);
  clip(0, x + 1, -1);
  clip(1, y, 1);
  clip(1, y + 1, -1);
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2d a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return std::abs(area);
}

/// Which shape covers each texel of each page (-1: none), by brute force. Fails where two shapes share a texel or one
/// leaves its page.
std::vector<std::vector<int>> ownersByBruteForce(const std::vector<PackShape>& shapes, const PackResult& result) {
  constexpr double kVisible = 1e-4;  // texels; less is what float coordinates add to a shape's border
  std::vector<std::vector<int>> owners;
  for (const auto& page : result.pages) owners.emplace_back(static_cast<std::size_t>(page[0] * page[1]), -1);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Placement& placement = result.placements[i];
    if (placement.page < 0) continue;
    const auto& size = result.pages[static_cast<std::size_t>(placement.page)];
    for (const Triangle& source : shapes[i].triangles) {
      const Triangle t = {placement.apply(source[0]), placement.apply(source[1]), placement.apply(source[2])};
      const Vec2 low = glm::min(t[0], glm::min(t[1], t[2])), high = glm::max(t[0], glm::max(t[1], t[2]));
      for (int y = static_cast<int>(std::floor(low.y)); y <= static_cast<int>(high.y); ++y)
        for (int x = static_cast<int>(std::floor(low.x)); x <= static_cast<int>(high.x); ++x) {
          if (overlapArea(t, x, y) < kVisible) continue;
          if (x < 0 || y < 0 || x >= size[0] || y >= size[1]) {
            ADD_FAILURE() << "shape " << i << " leaves its page at " << x << ", " << y;
            return owners;
          }
          int& owner = owners[static_cast<std::size_t>(placement.page)][static_cast<std::size_t>(y * size[0] + x)];
          if (owner >= 0 && owner != static_cast<int>(i)) {
            ADD_FAILURE() << "shapes " << owner << " and " << i << " share texel " << x << ", " << y;
            return owners;
          }
          owner = static_cast<int>(i);
        }
    }
  }
  return owners;
}

/// The least number of empty texels between two shapes (in the larger axis distance), up to `limit`; to the page's
/// border in *toBorder.
int leastGap(const std::vector<int>& owners, int width, int height, int limit, int* toBorder) {
  int gap = limit;
  const auto at = [&](int x, int y) { return owners[static_cast<std::size_t>(y * width + x)]; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (at(x, y) < 0) continue;
      *toBorder = std::min({*toBorder, x, y, width - 1 - x, height - 1 - y});
      for (int v = y; v <= std::min(height - 1, y + limit); ++v)
        for (int u = std::max(0, x - limit); u <= std::min(width - 1, x + limit); ++u)
          if (at(u, v) >= 0 && at(u, v) != at(x, y))
            gap = std::min(gap, std::max(std::abs(u - x), std::abs(v - y)) - 1);
    }
  return gap;
}

PackResult pack(const std::vector<PackShape>& shapes, const PackOptions& options) {
  Progress silent;
  auto result = packCharts(shapes, options, silent);
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(*result) : PackResult{};
}

TEST(Pack, ShapesKeepTheirPaddingOnEveryPage) {
  for (const int padding : {0, 1, 2, 3, 4}) {
    const std::vector<PackShape> shapes = randomStars(400, 5.0f, 7u + static_cast<unsigned>(padding));
    const PackResult result = pack(shapes, {.pageSize = 128, .padding = padding});
    EXPECT_GT(result.pages.size(), 1u);
    const auto owners = ownersByBruteForce(shapes, result);
    for (std::size_t page = 0; page < result.pages.size(); ++page) {
      int toBorder = 100;
      const int gap = leastGap(owners[page], result.pages[page][0], result.pages[page][1], padding + 2, &toBorder);
      EXPECT_GE(gap, padding) << "page " << page;
      const bool isDense = page + 1 < result.pages.size();
      if (isDense) {
        EXPECT_EQ(gap, padding) << "a dense page has a pair at exactly the padding";
      }
      EXPECT_GE(toBorder, (padding + 1) / 2);
    }
    for (const Placement& placement : result.placements) EXPECT_GE(placement.page, 0);
    for (std::size_t i = 0; i < shapes.size(); i += 3) EXPECT_EQ(result.placements[i].quarterTurns, 0);
  }
}

TEST(Pack, BlocksHoldOneShapeEach) {
  const std::vector<PackShape> shapes = randomStars(200, 5.0f, 3);
  for (const int padding : {0, 2, 5}) {
    const PackResult result = pack(shapes, {.pageSize = 128, .padding = padding, .blockAlign = 4});
    const auto owners = ownersByBruteForce(shapes, result);
    for (std::size_t page = 0; page < result.pages.size(); ++page) {
      const auto [width, height] = result.pages[page];
      int toBorder = 100;
      EXPECT_GE(leastGap(owners[page], width, height, padding + 1, &toBorder), padding);
      std::vector<int> blockOwner(static_cast<std::size_t>(width / 4 * (height / 4)), -1);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const int owner = owners[page][static_cast<std::size_t>(y * width + x)];
          int& block = blockOwner[static_cast<std::size_t>(y / 4 * (width / 4) + x / 4)];
          if (owner < 0) continue;
          EXPECT_TRUE(block < 0 || block == owner);
          block = owner;
        }
    }
  }
}

TEST(Pack, BlockAlignedShapesStartOnBlocksWithTheirMargin) {
  const std::vector<PackShape> shapes(9, rectangle(6, 9));
  for (const int padding : {0, 1, 2, 3}) {
    const PackResult result = pack(shapes, {.pageSize = 64, .padding = padding, .blockAlign = 4});
    const float margin = static_cast<float>((padding + 1) / 2);
    for (const Placement& p : result.placements) {
      const Vec2 a = p.apply(Vec2(0, 0)), b = p.apply(Vec2(6, 9));
      EXPECT_EQ(std::fmod(std::min(a.x, b.x) - margin, 4.0f), 0.0f);
      EXPECT_EQ(std::fmod(std::min(a.y, b.y) - margin, 4.0f), 0.0f);
    }
  }
}

TEST(Pack, BlocksFillAPageWhereShapesLeaveRoomForThePadding) {
  // 14 texels and a gutter of 2 are four blocks: 64 of them fill the page to the last block.
  const std::vector<PackShape> shapes(64, rectangle(14, 14));
  const PackResult result = pack(shapes, {.pageSize = 128, .maxPages = 1, .padding = 2, .blockAlign = 4});
  for (const Placement& p : result.placements) EXPECT_EQ(p.page, 0);
}

TEST(Pack, OfPlacesInOneRowTheOneThatTouchesMostIsTaken) {
  // A comb over the whole page with a slot of ten texels and one of six.
  PackShape comb = rectangle(64, 4, Vec2(0, 10));
  for (const auto& [x, width] : {std::pair{0.0f, 4.0f}, {14.0f, 4.0f}, {24.0f, 40.0f}}) {
    const PackShape tooth = rectangle(width, 10, Vec2(x, 0));
    comb.triangles.insert(comb.triangles.end(), tooth.triangles.begin(), tooth.triangles.end());
  }
  comb.mayRotate = false;
  const std::vector<PackShape> shapes = {comb, rectangle(6, 6)};
  const PackResult result = pack(shapes, {.pageSize = 64, .padding = 0, .shrinkLast = false});
  EXPECT_EQ(result.placements[1].apply(Vec2(3, 3)), Vec2(21, 3));
}

TEST(SnapFactors, MakeARectangleWholeWhereThatSavesRoom) {
  const GridSettings grid = gridSettings(64, 2, 0);
  const Vec2d both = snapFactors(rectangle(14.3f, 20.7f), grid);
  EXPECT_NEAR(both.x * 14.3, 14.0, 1e-5);
  EXPECT_NEAR(both.y * 20.7, 20.0, 1e-5);
  EXPECT_EQ(snapFactors(rectangle(14.0f, 20.0f), grid), Vec2d(1.0));
  EXPECT_EQ(snapFactors(rectangle(1.3f, 0.4f), grid), Vec2d(1.0)) << "a quarter off is too much";
  EXPECT_EQ(snapFactors(rectangle(0.0f, 20.7f), grid), Vec2d(1.0));
}

TEST(SnapFactors, LeaveShapesWithoutStraightSidesAlone) {
  const Vec2 a(0, 15.1f), b(15.1f, 0), c(30.2f, 15.1f), d(15.1f, 30.2f);
  const PackShape diamond = {{Triangle{a, b, c}, Triangle{a, c, d}}, 0, true};
  const Vec2d factors = snapFactors(diamond, gridSettings(64, 2, 0));
  // A texel less at two corners is worth no more than the diamond's own shrinking.
  EXPECT_GT(factors.x * factors.y, 0.98);
}

TEST(SnapFactors, LeaveRoomForTheMarginOnBlocks) {
  const Vec2d factors = snapFactors(rectangle(14.5f, 30.9f), gridSettings(64, 2, 4));
  EXPECT_NEAR(factors.x * 14.5, 14.0, 1e-5);
  EXPECT_NEAR(factors.y * 30.9, 30.0, 1e-5);
}

/// The shapes with the places that a packing gave them.
std::vector<PackShape> keeping(std::vector<PackShape> shapes, const PackResult& result) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Placement& p = result.placements[i];
    shapes[i].keep = KeptPlace{p.page, p.quarterTurns, p.x, p.y};
  }
  return shapes;
}

TEST(PackKept, ShapesStayAndNewOnesFillTheRoomBetween) {
  for (const int block : {0, 4}) {
    const PackOptions options{.pageSize = 128, .padding = 2, .blockAlign = block};
    const std::vector<PackShape> before = randomStars(300, 5.0f, 21);
    const PackResult first = pack(before, options);
    ASSERT_GT(first.pages.size(), 2u);
    std::vector<PackShape> after = keeping(before, first);
    for (std::size_t i = 0; i < 20; ++i) {  // other shapes in place of some
      after[i * 7].keep.reset();
      after[i * 7].triangles = randomStars(1, 4.0f, static_cast<unsigned>(100 + i))[0].triangles;
    }
    const PackResult second = pack(after, options);
    for (std::size_t i = 0; i < after.size(); ++i) {
      EXPECT_EQ(second.placements[i].kept, after[i].keep.has_value());
      if (!after[i].keep) continue;
      EXPECT_EQ(second.placements[i].page, first.placements[i].page);
      EXPECT_EQ(second.placements[i].quarterTurns, first.placements[i].quarterTurns);
      EXPECT_EQ(second.placements[i].offset, first.placements[i].offset);
    }
    EXPECT_LE(second.pages.size(), first.pages.size() + 1) << "what was taken away left room for most";
    const auto owners = ownersByBruteForce(after, second);
    for (std::size_t page = 0; page < second.pages.size(); ++page) {
      int toBorder = 100;
      EXPECT_GE(leastGap(owners[page], second.pages[page][0], second.pages[page][1], 3, &toBorder), 2);
      EXPECT_GE(toBorder, 1);
    }
  }
}

TEST(PackKept, ANewGroupStaysTogetherOnANewPageWhereNoPageHasRoomForAllOfIt) {
  std::vector<PackShape> shapes(3, rectangle(40, 60));
  const PackOptions options{.pageSize = 128, .padding = 2};
  const PackResult first = pack(shapes, options);
  shapes = keeping(shapes, first);
  for (int i = 0; i < 4; ++i) {
    shapes.push_back(rectangle(50, 50));
    shapes.back().group = 1;
  }
  const PackResult second = pack(shapes, options);
  ASSERT_EQ(second.pages.size(), 2u);
  for (std::size_t i = 0; i < shapes.size(); ++i) EXPECT_EQ(second.placements[i].page, i < 3 ? 0 : 1);
}

TEST(PackKept, PlacesThatCannotBeKeptAreGivenUp) {
  std::vector<PackShape> shapes(8, rectangle(10, 20));
  constexpr int kFar = 1 << 30;
  const KeptPlace places[] = {{0, 0, 5, 5},  {0, 0, 14, 5},  {0, 0, -3, 5}, {0, 0, kFar, kFar},
                              {7, 0, 40, 5}, {-1, 0, 40, 5}, {0, 9, 40, 5}, {1, 1, 20, 30}};
  for (std::size_t i = 0; i < shapes.size(); ++i) shapes[i].keep = places[i];
  const PackResult result = pack(shapes, {.pageSize = 64, .padding = 2});
  EXPECT_TRUE(result.placements[0].kept);
  EXPECT_FALSE(result.placements[1].kept) << "a texel short of the padding";
  EXPECT_FALSE(result.placements[2].kept) << "off the page";
  EXPECT_FALSE(result.placements[3].kept) << "far off the page";
  EXPECT_FALSE(result.placements[6].kept) << "no such turn";
  EXPECT_TRUE(result.placements[7].kept) << "a page that nothing else asked for";
  for (const Placement& p : result.placements) EXPECT_GE(p.page, 0);
  ownersByBruteForce(shapes, result);
}

TEST(Pack, SameForAnyThreadCount) {
  const std::vector<PackShape> shapes = randomStars(1500, 6.0f, 11);
  const PackOptions options{.pageSize = 256, .padding = 2};
  PackResult results[2];
  for (int threads : {1, 2}) {
    ThreadLimit limit(threads);
    results[threads - 1] = pack(shapes, options);
  }
  ASSERT_EQ(results[0].pages, results[1].pages);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    EXPECT_EQ(results[0].placements[i].page, results[1].placements[i].page);
    EXPECT_EQ(results[0].placements[i].quarterTurns, results[1].placements[i].quarterTurns);
    EXPECT_EQ(results[0].placements[i].offset, results[1].placements[i].offset);
  }
}

TEST(Pack, PairOfEllsInterlocks) {
  // Two Ls of 28 x 28 with legs of 8: side by side they need 56 texels and more, turned into one another they fit a
  // page of 40 (28 + 2 padding + 8 = 38, and one texel to each border).
  const std::vector<PackShape> shapes(2, ell(28, 8));
  const PackResult result = pack(shapes, {.pageSize = 40, .maxPages = 1, .padding = 2, .shrinkLast = false});
  EXPECT_EQ(result.placements[0].page, 0);
  EXPECT_EQ(result.placements[1].page, 0);
  ownersByBruteForce(shapes, result);
}

TEST(Pack, SmallShapesFillHoles) {
  // A frame of 60 x 60 around a hole of 40 x 40, and a rectangle that fits only there.
  PackShape frame;
  for (const PackShape& side : {rectangle(60, 10), rectangle(60, 10, Vec2(0, 50)), rectangle(10, 40, Vec2(0, 10)),
                                rectangle(10, 40, Vec2(50, 10))})
    frame.triangles.insert(frame.triangles.end(), side.triangles.begin(), side.triangles.end());
  const PackResult result = pack({frame, rectangle(36, 36)}, {.pageSize = 62, .maxPages = 1, .padding = 2});
  ASSERT_EQ(result.placements[1].page, 0);
  const Vec2 centre = result.placements[1].apply(Vec2(18, 18));
  EXPECT_NEAR(centre.x, 31, 2.01);
  EXPECT_NEAR(centre.y, 31, 2.01);
}

TEST(Pack, WholeTexelRectanglesWasteNothing) {
  // 16 squares of 14 x 14 at padding 2 tile 64 x 64 exactly: 4 * 14 + 3 * 2 + 2 * 1.
  const std::vector<PackShape> shapes(16, rectangle(14, 14, Vec2(0.3f, 1e4f)));
  const PackResult result = pack(shapes, {.pageSize = 64, .maxPages = 1, .padding = 2});
  for (const Placement& p : result.placements) EXPECT_EQ(p.page, 0);
}

TEST(Pack, TriesOtherOrdersBeforeGivingUp) {
  // A bar, two squares of 36 side by side and three rectangles of 36 x 27: standing, the three fill the width of 85
  // exactly. By size alone they lie down, two to a row, and the third finds no place.
  std::vector<PackShape> shapes(2, rectangle(36, 36));
  shapes.insert(shapes.end(), 3, rectangle(36, 27));
  shapes.push_back(rectangle(72, 8));
  const PackResult result = pack(shapes, {.pageSize = 87, .maxPages = 1, .padding = 2, .shrinkLast = false});
  for (const Placement& p : result.placements) EXPECT_EQ(p.page, 0);
  ownersByBruteForce(shapes, result);
}

TEST(Pack, GroupsStayTogether) {
  // Four squares of 30 fill a page of 64, in input order they come from four groups.
  std::vector<PackShape> shapes;
  for (std::uint32_t i = 0; i < 16; ++i) {
    shapes.push_back(rectangle(30, 30));
    shapes.back().group = i % 4;
  }
  const PackResult result = pack(shapes, {.pageSize = 64, .padding = 2});
  ASSERT_EQ(result.pages.size(), 4u);
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(result.placements[i].page, result.placements[i % 4].page);
}

TEST(Pack, LastPageShrinksToPowersOfTwo) {
  EXPECT_EQ(pack({rectangle(60, 20)}, {.pageSize = 1024, .padding = 2}).pages[0], (std::array<int, 2>{64, 32}));
  EXPECT_EQ(pack({rectangle(62, 30)}, {.pageSize = 1024, .padding = 2}).pages[0], (std::array<int, 2>{64, 32}));
  EXPECT_EQ(pack({rectangle(63, 30)}, {.pageSize = 1024, .padding = 2}).pages[0], (std::array<int, 2>{128, 32}));
  EXPECT_EQ(pack({rectangle(60, 20)}, {.pageSize = 1000, .padding = 2, .shrinkLast = false}).pages[0],
            (std::array<int, 2>{1000, 1000}));
}

TEST(Pack, TooFewPagesLeavesShapesOut) {
  const std::vector<PackShape> shapes(10, rectangle(30, 30));
  const PackResult one = pack(shapes, {.pageSize = 64, .maxPages = 1, .padding = 2});
  int out = 0;
  for (const Placement& p : one.placements) out += p.page < 0;
  EXPECT_GT(out, 0);
  const PackResult two = pack(shapes, {.pageSize = 64, .maxPages = 2, .padding = 2});
  out = 0;
  for (const Placement& p : two.placements) out += p.page < 0;
  EXPECT_GE(out, 2);
}

TEST(Pack, ShapeLargerThanThePageIsAUsageError) {
  Progress silent;
  for (const float size : {63.5f, 1e9f}) {
    const std::vector<PackShape> shapes = {rectangle(3, 3), rectangle(size, 2)};
    const auto result = packCharts(shapes, {.pageSize = 64, .padding = 2}, silent);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::Usage);
    EXPECT_TRUE(mentions(result.error().message, "chart 1"));
  }
}

TEST(Pack, StopsWhenCancelled) {
  struct Cancelled : Progress {
    bool cancelled() const override { return true; }
  } progress;
  const std::vector<PackShape> shapes(3, rectangle(3, 3));
  const auto result = packCharts(shapes, {}, progress);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Interrupted);
}

TEST(Pack, NothingToPack) {
  const PackResult result = pack({}, {});
  EXPECT_TRUE(result.placements.empty());
  EXPECT_TRUE(result.pages.empty());
}

TEST(Pack, ShapesWithoutAreaTakeNoRoom) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<PackShape> shapes = {
      rectangle(14, 14),
      PackShape{},
      PackShape{{Triangle{Vec2(5, 5), Vec2(5, 5), Vec2(5, 5)}}, 0, true},
      PackShape{{Triangle{Vec2(0, 0), Vec2(5, 5), Vec2(10, 10)}}, 0, true},
      PackShape{{Triangle{Vec2(nan, 0), Vec2(5, 5), Vec2(10, 0)}}, 0, true},
  };
  const PackResult result = pack(shapes, {.pageSize = 16, .maxPages = 1, .padding = 2});
  for (const Placement& p : result.placements) EXPECT_EQ(p.page, 0);
  EXPECT_EQ(result.placements[2].apply(Vec2(5, 5)), Vec2(1, 1));
  EXPECT_EQ(pack({PackShape{}}, {}).pages.size(), 1u);
}

TEST(Pack, SliversGetTheirRowOfTexels) {
  const std::vector<PackShape> shapes(12, PackShape{{Triangle{Vec2(0, 0), Vec2(50, 0), Vec2(50, 1e-4f)}}, 0, false});
  const PackResult result = pack(shapes, {.pageSize = 64, .padding = 2});
  ASSERT_EQ(result.pages.size(), 1u);
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE(std::abs(result.placements[i].offset.y - result.placements[j].offset.y), 3.0f);
}

TEST(Pack, TwentyThousandTinyShapesAreQuick) {
  const std::vector<PackShape> shapes = randomStars(20000, 1.2f, 5);
  const Stopwatch stopwatch;
  const PackResult result = pack(shapes, {.pageSize = 1024, .padding = 2});
  const double seconds = stopwatch.seconds();
  RecordProperty("milliseconds", static_cast<int>(seconds * 1e3));
  EXPECT_LT(seconds, 60.0);  // a fraction of a second when optimised; sanitizers on a busy machine need far longer
  for (const Placement& p : result.placements) EXPECT_GE(p.page, 0);
}

}  // namespace
}  // namespace lumel
