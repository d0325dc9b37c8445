#include "lightmap/texels/texels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// A surface in the plane z = 0 whose positions are its texel coordinates, plus `origin`.
Surface flatSurface(const std::vector<std::array<Vec2, 3>>& triangles, int width, int height, Vec3 origin = Vec3(0)) {
  Surface surface;
  for (const auto& triangle : triangles)
    for (const Vec2& p : triangle) {
      surface.indices.push_back(static_cast<std::uint32_t>(surface.positions.size()));
      surface.positions.push_back(origin + Vec3(p, 0));
      surface.normals.push_back(Vec3(0, 0, 1));
      surface.tangents.push_back(Vec4(1, 0, 0, 1));
      surface.lightmapUvs.push_back(p / Vec2(width, height));
    }
  surface.sourceTriangle.resize(triangles.size());
  surface.charts.resize(triangles.size());
  return surface;
}

Atlas atlasOf(const std::vector<std::array<Vec2, 3>>& triangles, int width = 16, int height = 16) {
  Atlas atlas;
  atlas.pages = {{width, height}};
  atlas.charts.resize(1);
  atlas.surfaces = {flatSurface(triangles, width, height)};
  return atlas;
}

double areaOf(const std::array<Vec2, 3>& t) {
  const Vec2d a(t[0]), b(t[1]), c(t[2]);
  return 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y));
}

double totalArea(const Atlas& atlas, const PageTexels& page) {
  TexelFootprint footprint;
  double sum = 0;
  for (std::size_t i = 0; i < page.size(); ++i) sum += footprint.clip(atlas, page, i);
  return sum;
}

std::vector<std::array<Vec2, 3>> randomTriangles(std::size_t count, int size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0.0f, static_cast<float>(size));
  std::vector<std::array<Vec2, 3>> triangles(count);
  for (auto& triangle : triangles)
    for (Vec2& p : triangle) p = Vec2(uniform(random), uniform(random));
  return triangles;
}

TEST(FindTexels, HalfASquareCoversItsDiagonalToo) {
  const Atlas atlas = atlasOf({{Vec2(2, 3), Vec2(6, 3), Vec2(2, 7)}});
  const auto pages = findTexels(atlas);
  ASSERT_EQ(pages.size(), 1u);
  EXPECT_EQ(pages[0].size(), 10u);  // rows of 4, 3, 2 and 1: no texel that is only touched
  TexelFootprint footprint;
  for (std::size_t i = 0; i < pages[0].size(); ++i) {
    const TexelCoord c = pages[0].coords[i];
    EXPECT_NEAR(footprint.clip(atlas, pages[0], i), c.x + c.y == 8 ? 0.5 : 1.0, 1e-12) << c.x << ", " << c.y;
  }
}

TEST(FindTexels, OrderIsTilesThenRows) {
  const Atlas atlas =
      atlasOf({{Vec2(0, 0), Vec2(10, 0), Vec2(10, 10)}, {Vec2(0, 0), Vec2(10, 10), Vec2(0, 10)}}, 10, 10);
  const PageTexels page = findTexels(atlas)[0];
  ASSERT_EQ(page.size(), 100u);
  const auto key = [](TexelCoord c) { return std::array<int, 4>{c.y / 4, c.x / 4, c.y % 4, c.x % 4}; };
  for (std::size_t i = 1; i < page.size(); ++i) EXPECT_LT(key(page.coords[i - 1]), key(page.coords[i]));
  EXPECT_EQ(page.firstTriangle.size(), 101u);
  EXPECT_EQ(page.firstTriangle.back(), page.triangles.size());
}

TEST(FindTexels, MatchesClippingForRandomTriangles) {
  const auto triangles = randomTriangles(60, 40, 1);
  const Atlas atlas = atlasOf(triangles, 40, 37);  // UVs are scaled by the page, some rows are cut by bands of 16
  const PageTexels page = findTexels(atlas)[0];
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> found;
  for (std::size_t i = 0; i < page.size(); ++i)
    for (const TriangleRef& ref : page.trianglesOf(i))
      found[{page.coords[i].x, page.coords[i].y}].push_back(ref.triangle);
  // By clipping every triangle to every texel.
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> expected;
  for (int y = 0; y < 37; ++y)
    for (int x = 0; x < 40; ++x)
      for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        PageTexels single{40, 37, {{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)}}, {0, 1}, {{0, t}}};
        TexelFootprint footprint;
        if (footprint.clip(atlas, single, 0) > 0) expected[{x, y}].push_back(t);
      }
  EXPECT_EQ(found, expected);
}

TEST(FindTexels, SeveralSurfacesAndPages) {
  Atlas atlas;
  atlas.pages = {{16, 16}, {8, 4}};
  atlas.surfaces.push_back(flatSurface({{Vec2(0, 0), Vec2(3, 0), Vec2(0, 3)}}, 16, 16));
  atlas.surfaces.push_back(flatSurface({{Vec2(0, 0), Vec2(8, 0), Vec2(8, 4)}}, 8, 4));
  atlas.surfaces.push_back(flatSurface({{Vec2(3, 3), Vec2(3, 0), Vec2(0, 3)}}, 16, 16));
  atlas.surfaces[1].page = 1;
  const auto pages = findTexels(atlas);
  EXPECT_EQ(pages[0].size(), 9u);
  EXPECT_EQ(pages[1].size(), 20u);
  for (std::size_t i = 0; i < pages[0].size(); ++i) {
    const auto refs = pages[0].trianglesOf(i);
    EXPECT_TRUE(std::is_sorted(refs.begin(), refs.end(),
                               [](const TriangleRef& a, const TriangleRef& b) { return a.surface < b.surface; }));
    for (const TriangleRef& ref : refs) EXPECT_NE(ref.surface, 1u);
  }
}

TEST(FindTexels, SameForAnyThreadCount) {
  const Atlas atlas = atlasOf(randomTriangles(500, 200, 9), 200, 200);
  std::vector<PageTexels> results;
  for (const int threads : {1, 2}) {
    ThreadLimit limit(threads);
    results.push_back(findTexels(atlas)[0]);
  }
  ASSERT_EQ(results[0].firstTriangle, results[1].firstTriangle);
  for (std::size_t i = 0; i < results[0].size(); ++i)
    EXPECT_TRUE(results[0].coords[i].x == results[1].coords[i].x && results[0].coords[i].y == results[1].coords[i].y);
  for (std::size_t i = 0; i < results[0].triangles.size(); ++i)
    EXPECT_EQ(results[0].triangles[i].triangle, results[1].triangles[i].triangle);
}

TEST(FindTexels, DegenerateInput) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const Atlas atlas = atlasOf({{Vec2(1, 1), Vec2(1, 1), Vec2(1, 1)},
                               {Vec2(1, 1), Vec2(5, 5), Vec2(9, 9)},
                               {Vec2(1, 1), Vec2(9, 1), Vec2(5, 1)},
                               {Vec2(nan, 1), Vec2(9, 1), Vec2(5, 3)},
                               {Vec2(1, 1), Vec2(inf, 1), Vec2(5, 3)},
                               {Vec2(1, nan), Vec2(9, 1), Vec2(5, 3)}});
  EXPECT_EQ(findTexels(atlas)[0].size(), 0u);
  EXPECT_TRUE(findTexels(Atlas{}).empty());
  EXPECT_EQ(findTexels(atlasOf({}))[0].firstTriangle.size(), 1u);
  // What lies outside the page is cut off, however far out.
  EXPECT_EQ(findTexels(atlasOf({{Vec2(-1e9f, -1e9f), Vec2(1e9f, -1e9f), Vec2(0, 1e9f)}}))[0].size(), 256u);
  EXPECT_EQ(findTexels(atlasOf({{Vec2(40, 40), Vec2(50, 40), Vec2(40, 50)}}))[0].size(), 0u);
}

TEST(FindTexels, RoundingToFloatAddsNoTexels) {
  // A page that is no power of two: 300 / 1000.0f * 1000 is not 300.
  for (int border = 1; border < 1000; border += 7) {
    const auto end = static_cast<float>(border);
    const Atlas atlas =
        atlasOf({{Vec2(0, 0), Vec2(end, 0), Vec2(end, 1)}, {Vec2(0, 0), Vec2(end, 1), Vec2(0, 1)}}, 1000, 1000);
    EXPECT_EQ(findTexels(atlas)[0].size(), static_cast<std::size_t>(border));
  }
}

TEST(Footprint, NeighboursDoNotChangeIt) {
  const Atlas atlas = atlasOf(randomTriangles(60, 40, 1), 40, 37);
  const Atlas other = atlasOf(randomTriangles(60, 40, 2), 40, 37);
  const PageTexels page = findTexels(atlas)[0], otherPage = findTexels(other)[0];
  TexelFootprint reused;
  for (std::size_t i = 0; i < page.size(); ++i) {
    if (i % 50 == 0 && i < otherPage.size()) reused.clip(other, otherPage, i);
    TexelFootprint fresh;
    EXPECT_EQ(reused.clip(atlas, page, i), fresh.clip(atlas, page, i));
    ASSERT_EQ(reused.pieces().size(), fresh.pieces().size());
    if (fresh.area() > 0) {
      EXPECT_EQ(reused.sample({0.3f, 0.6f}).position, fresh.sample({0.3f, 0.6f}).position);
      EXPECT_EQ(reused.centroid().geometricNormal, fresh.centroid().geometricNormal);
    }
  }
}

TEST(Footprint, AreasSumToTheTriangle) {
  const auto triangles = randomTriangles(40, 16, 4);
  for (const auto& triangle : triangles) {
    const Atlas atlas = atlasOf({triangle});
    const PageTexels page = findTexels(atlas)[0];
    // Snapping moves a side by at most 1/1024 texel along its length.
    const double perimeter = glm::distance(triangle[0], triangle[1]) + glm::distance(triangle[1], triangle[2]) +
                             glm::distance(triangle[2], triangle[0]);
    EXPECT_NEAR(totalArea(atlas, page), areaOf(triangle), perimeter / 1024 + 1e-5);
  }
  // Corners away from texel borders are not moved: exact but for UVs as floats.
  const std::array<Vec2, 3> exact = {Vec2(0.25f, 0.5f), Vec2(13.25f, 2.5f), Vec2(7.75f, 15.5f)};
  const Atlas atlas = atlasOf({exact});
  EXPECT_NEAR(totalArea(atlas, findTexels(atlas)[0]), areaOf(exact), 1e-12);
}

TEST(Footprint, MirroredTriangleIsAsGood) {
  const Atlas atlas = atlasOf({{Vec2(2.5f, 2), Vec2(4, 9.5f), Vec2(11.5f, 4)}});
  Atlas mirrored = atlas;
  std::swap(mirrored.surfaces[0].lightmapUvs[1], mirrored.surfaces[0].lightmapUvs[2]);
  const PageTexels page = findTexels(mirrored)[0];
  EXPECT_NEAR(totalArea(mirrored, page), totalArea(atlas, findTexels(atlas)[0]), 1e-9);
  TexelFootprint footprint;
  for (std::size_t i = 0; i < page.size(); ++i) {
    footprint.clip(mirrored, page, i);
    const SurfacePoint p = footprint.sample(Vec2(0.3f, 0.7f));
    EXPECT_EQ(p.geometricNormal, footprint.centroid().geometricNormal);
    EXPECT_NEAR(p.geometricNormal.z, -1, 1e-6);  // of the winding in space, whatever the UVs
  }
}

TEST(Footprint, SamplesStayInTexelAndTriangle) {
  auto triangles = randomTriangles(30, 16, 6);
  triangles.push_back({Vec2(1, 1), Vec2(15, 1.001f), Vec2(8, 1.0015f)});                    // sliver along a row
  triangles.push_back({Vec2(1.3f, 1.2f), Vec2(14.9f, 13.1f), Vec2(14.9f, 13.1f + 1e-4f)});  // sliver across
  triangles.push_back({Vec2(3.2f, 3.2f), Vec2(3.4f, 3.2f), Vec2(3.3f, 3.5f)});              // within one texel
  const Atlas atlas = atlasOf(triangles);
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (std::size_t i = 0; i < page.size(); ++i) {
    if (!(footprint.clip(atlas, page, i) > 0)) continue;
    for (int k = 0; k < 66; ++k) {
      const Vec2 corners[] = {Vec2(0, 0), Vec2(0.99999994f, 0), Vec2(0, 0.99999994f), Vec2(0.99999994f)};
      const Vec2 u = k < 4 ? corners[k] : Vec2(uniform(random), uniform(random));
      const SurfacePoint p = k < 65 ? footprint.sample(u) : footprint.centroid();
      // Positions are texel coordinates here; snapping and float cost 1/1024 texel and a little.
      EXPECT_GE(p.position.x, page.coords[i].x - 0.0012f);
      EXPECT_LE(p.position.x, page.coords[i].x + 1.0012f);
      EXPECT_GE(p.position.y, page.coords[i].y - 0.0012f);
      EXPECT_LE(p.position.y, page.coords[i].y + 1.0012f);
      EXPECT_GE(std::min({p.barycentric.x, p.barycentric.y, p.barycentric.z}), 0.0f);
      EXPECT_NEAR(p.barycentric.x + p.barycentric.y + p.barycentric.z, 1.0f, 3e-7f);
      const auto refs = page.trianglesOf(i);
      EXPECT_TRUE(std::any_of(refs.begin(), refs.end(),
                              [&](const TriangleRef& r) { return r.triangle == p.triangle.triangle; }));
    }
  }
}

TEST(Footprint, SamplesAreUniformByArea) {
  // A texel cut by three triangles that together leave a corner of it empty.
  const Atlas atlas = atlasOf({{Vec2(3.1f, 3), Vec2(4.6f, 3.2f), Vec2(3.3f, 4.4f)},
                               {Vec2(4.6f, 3.2f), Vec2(4.1f, 4.2f), Vec2(3.3f, 4.4f)},
                               {Vec2(3.1f, 3), Vec2(3.3f, 4.4f), Vec2(2.5f, 3.9f)}});
  const PageTexels page = findTexels(atlas)[0];
  std::size_t texel = 0;
  while (page.coords[texel].x != 3 || page.coords[texel].y != 3) ++texel;
  TexelFootprint footprint;
  const double area = footprint.clip(atlas, page, texel);
  ASSERT_EQ(page.trianglesOf(texel).size(), 3u);
  ASSERT_LT(area, 1.0);
  // Expected share of each cell of an 8 x 8 grid over the texel: by the same polygons on a fine grid of points.
  constexpr int kCells = 8, kFine = 128;
  const auto inside = [&](Vec2d p) {
    for (std::uint32_t t = 0; t < 3; ++t) {
      double sign[3];
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec2d a = Vec2d(atlas.surfaces[0].lightmapUvs[3 * t + i]) * 16.0;
        const Vec2d b = Vec2d(atlas.surfaces[0].lightmapUvs[3 * t + (i + 1) % 3]) * 16.0;
        sign[i] = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
      }
      if ((sign[0] >= 0 && sign[1] >= 0 && sign[2] >= 0) || (sign[0] <= 0 && sign[1] <= 0 && sign[2] <= 0)) return true;
    }
    return false;
  };
  std::vector<double> share(kCells * kCells, 0.0);
  double total = 0;
  for (int y = 0; y < kCells * kFine; ++y)
    for (int x = 0; x < kCells * kFine; ++x)
      if (inside(Vec2d(3 + (x + 0.5) / (kCells * kFine), 3 + (y + 0.5) / (kCells * kFine)))) {
        share[static_cast<std::size_t>(y / kFine * kCells + x / kFine)] += 1;
        total += 1;
      }
  EXPECT_NEAR(total / (kCells * kFine * kCells * kFine), area, 1e-4);

  constexpr int kSamples = 400000;
  std::vector<double> hits(kCells * kCells, 0.0);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 p = footprint.sample(Vec2(uniform(random), uniform(random))).position;
    const int x = std::clamp(static_cast<int>((p.x - 3) * kCells), 0, kCells - 1);
    const int y = std::clamp(static_cast<int>((p.y - 3) * kCells), 0, kCells - 1);
    hits[static_cast<std::size_t>(y * kCells + x)] += 1;
  }
  double chi2 = 0;
  int cells = 0;
  for (std::size_t i = 0; i < share.size(); ++i) {
    const double expected = kSamples * share[i] / total;
    if (expected < 5) continue;
    chi2 += (hits[i] - expected) * (hits[i] - expected) / expected;
    ++cells;
  }
  // Mean cells - 1, standard deviation sqrt(2 (cells - 1)): four of them above is a chance of 1 in 10,000.
  EXPECT_LT(chi2, cells - 1 + 4 * std::sqrt(2.0 * (cells - 1)));
  EXPECT_GT(cells, 50);
}

TEST(Footprint, StratifiedInputStaysStratified) {
  // One triangle in one texel: each row of strata in u.x is a band of equal area about corner 0.
  const Atlas atlas = atlasOf({{Vec2(2, 2), Vec2(3, 2), Vec2(2, 3)}});
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  footprint.clip(atlas, page, 0);
  for (int i = 0; i < 16; ++i)
    for (int j = 0; j < 16; ++j) {
      const Vec3 p =
          footprint.sample(Vec2((static_cast<float>(i) + 0.5f) / 16, (static_cast<float>(j) + 0.5f) / 16)).position;
      const float share = (p.x - 2 + p.y - 2) * (p.x - 2 + p.y - 2);
      EXPECT_NEAR(share, (static_cast<float>(i) + 0.5f) / 16, 1e-5f);
      EXPECT_NEAR((p.y - 2) / (p.x - 2 + p.y - 2), (static_cast<float>(j) + 0.5f) / 16, 1e-5f);
    }
}

TEST(Footprint, WholeTexelsAreSampledAsSquares) {
  const Atlas atlas = atlasOf({{Vec2(1, 1), Vec2(9, 2), Vec2(2, 9)}});
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  int whole = 0;
  for (std::size_t i = 0; i < page.size(); ++i) {
    if (footprint.clip(atlas, page, i) != 1.0) continue;
    ++whole;
    const Vec2 u(0.3f, 0.8f);
    const Vec3 p = footprint.sample(u).position;  // its x and y are texels
    EXPECT_NEAR(p.x, page.coords[i].x + u.x, 1e-5f);
    EXPECT_NEAR(p.y, page.coords[i].y + u.y, 1e-5f);
  }
  EXPECT_GT(whole, 10);
}

TEST(Footprint, CentroidOfWholeTexelIsItsMiddleAndLiesOnTheSurface) {
  const Atlas square = atlasOf({{Vec2(0, 0), Vec2(4, 0), Vec2(4, 4)}, {Vec2(0, 0), Vec2(4, 4), Vec2(0, 4)}});
  const PageTexels page = findTexels(square)[0];
  TexelFootprint footprint;
  for (std::size_t i = 0; i < page.size(); ++i) {
    EXPECT_NEAR(footprint.clip(square, page, i), 1.0, 1e-12);
    const Vec3 c = footprint.centroid().position;
    EXPECT_NEAR(c.x, page.coords[i].x + 0.5, 1e-6);
    EXPECT_NEAR(c.y, page.coords[i].y + 0.5, 1e-6);
  }
  // Two triangles in opposite corners of a texel: the mean lies on neither.
  const Atlas corners =
      atlasOf({{Vec2(5, 5), Vec2(5.3f, 5), Vec2(5, 5.3f)}, {Vec2(6, 6), Vec2(5.7f, 6), Vec2(6, 5.7f)}});
  const PageTexels two = findTexels(corners)[0];
  ASSERT_EQ(two.size(), 1u);
  footprint.clip(corners, two, 0);
  const Vec3 c = footprint.centroid().position;
  EXPECT_TRUE(c.x + c.y <= 10.301f || c.x + c.y >= 11.699f) << c.x << ", " << c.y;
}

TEST(Footprint, OverlapCountsTwice) {
  const Atlas atlas = atlasOf({{Vec2(0, 0), Vec2(8, 0), Vec2(0, 8)}, {Vec2(0, 0), Vec2(8, 0), Vec2(0, 8)}});
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  EXPECT_NEAR(footprint.clip(atlas, page, 0), 2.0, 1e-12);
}

TEST(SurfacePoint, FrameIsOrthonormalAndInterpolated) {
  Atlas atlas = atlasOf({{Vec2(0, 0), Vec2(12, 1), Vec2(3, 14)}});
  Surface& s = atlas.surfaces[0];
  s.normals = {glm::normalize(Vec3(0.3f, 0, 1)), glm::normalize(Vec3(-0.2f, 0.5f, 1)),
               glm::normalize(Vec3(0, -0.4f, 1))};
  s.tangents = {Vec4(0.96f, 0.28f, 0, -1), Vec4(0.8f, -0.6f, 0, -1), Vec4(1, 0, 0, -1)};
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  for (std::size_t i = 0; i < page.size(); ++i) {
    footprint.clip(atlas, page, i);
    const SurfacePoint p = footprint.sample(Vec2(0.4f, 0.6f));
    const Frame& f = p.frame;
    EXPECT_NEAR(glm::dot(f.t, f.t), 1, 1e-5);
    EXPECT_NEAR(glm::dot(f.n, f.n), 1, 1e-5);
    EXPECT_NEAR(glm::dot(f.t, f.n), 0, 1e-6);
    EXPECT_NEAR(glm::distance(f.b, -glm::cross(f.n, f.t)), 0, 1e-6);
    const Vec3 normal =
        p.barycentric.x * s.normals[0] + p.barycentric.y * s.normals[1] + p.barycentric.z * s.normals[2];
    EXPECT_NEAR(glm::distance(f.n, glm::normalize(normal)), 0, 1e-6);
    EXPECT_NEAR(glm::distance(p.geometricNormal, Vec3(0, 0, 1)), 0, 1e-6);
    const Vec3 position =
        p.barycentric.x * s.positions[0] + p.barycentric.y * s.positions[1] + p.barycentric.z * s.positions[2];
    EXPECT_NEAR(glm::distance(p.position, position), 0, 1e-5);
  }
}

TEST(SurfacePoint, BadNormalsFallBackToTheGeometry) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3 bad : {Vec3(0), Vec3(nan), Vec3(nan, 0, 1)}) {
    Atlas atlas = atlasOf({{Vec2(0, 0), Vec2(3, 0), Vec2(0, 3)}});
    atlas.surfaces[0].normals.assign(3, bad);
    atlas.surfaces[0].tangents.assign(3, Vec4(0, 0, 1, 1));  // parallel to the normal
    const PageTexels page = findTexels(atlas)[0];
    TexelFootprint footprint;
    footprint.clip(atlas, page, 0);
    const SurfacePoint p = footprint.sample(Vec2(0.5f));
    EXPECT_EQ(p.frame.n, Vec3(0, 0, 1));
    EXPECT_NEAR(glm::dot(p.frame.t, p.frame.n), 0, 1e-6);
    EXPECT_NEAR(glm::length(p.frame.t), 1, 1e-6);
  }
  // Opposite normals cancel half way.
  Atlas atlas = atlasOf({{Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}});
  atlas.surfaces[0].normals = {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(-1, 0, 0)};
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  footprint.clip(atlas, page, 0);
  for (float u = 0; u < 1; u += 1.0f / 64) EXPECT_TRUE(isFinite(footprint.sample(Vec2(u, 0.5f)).frame.n));
}

TEST(SurfacePoint, TriangleWithoutAreaInSpaceTakesItsVertexNormal) {
  Atlas atlas = atlasOf({{Vec2(0, 0), Vec2(3, 0), Vec2(0, 3)}});
  atlas.surfaces[0].positions.assign(3, Vec3(1, 2, 3));
  atlas.surfaces[0].normals.assign(3, Vec3(0, 1, 0));
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  footprint.clip(atlas, page, 0);
  const SurfacePoint p = footprint.sample(Vec2(0.5f));
  EXPECT_EQ(p.position, Vec3(1, 2, 3));
  EXPECT_EQ(p.geometricNormal, Vec3(0, 1, 0));
}

TEST(SurfacePoint, FarFromTheOrigin) {
  Atlas atlas;
  atlas.pages = {{16, 16}};
  const Vec3 origin(1e6f, -1e6f, 1e6f);
  atlas.surfaces = {flatSurface({{Vec2(0, 0), Vec2(16, 0), Vec2(0, 16)}}, 16, 16, origin)};
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  for (std::size_t i = 0; i < page.size(); ++i) {
    footprint.clip(atlas, page, i);
    const SurfacePoint p = footprint.sample(Vec2(0.5f));
    EXPECT_EQ(p.geometricNormal, Vec3(0, 0, 1));
    // One float step at 1e6 is 0.0625.
    EXPECT_NEAR(p.position.x - origin.x, page.coords[i].x + 0.5, 0.5625);
    EXPECT_NEAR(p.position.y - origin.y, page.coords[i].y + 0.5, 0.5625);
    EXPECT_EQ(p.position.z, origin.z);
  }
}

}  // namespace
}  // namespace lumel
