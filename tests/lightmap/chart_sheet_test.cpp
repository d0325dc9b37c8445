// What may join a chart: parts that would share texels with far ones may not.
#include "lightmap/charts/chart_sheet.h"

#include <gtest/gtest.h>

#include <numeric>

namespace lumel {
namespace {

/// A mesh of points in texels that sets no frames.
HalfEdgeMesh meshOf(std::vector<Vec3> points, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  TriangleSoup soup;
  soup.normals.assign(points.size(), Vec3(0, 0, 1));
  soup.frames.assign(points.size(), Vec4(0));
  soup.points.positions = std::move(points);
  for (const auto& t : triangles) soup.indices.insert(soup.indices.end(), t.begin(), t.end());
  return buildHalfEdgeMesh(std::move(soup));
}

/// The triangles as one chart, each point where the mesh has it but for its z.
FlatChart flatChart(const HalfEdgeMesh& mesh, std::vector<std::uint32_t> triangles) {
  FlatChart flat;
  flat.mesh = makeChartMesh(mesh, std::move(triangles));
  for (const Vec3d& p : flat.mesh.points.all()) flat.uvs.push_back(Vec2d(p));
  return flat;
}

struct TwoCharts {
  HalfEdgeMesh mesh;
  FlatChart big, small;
  std::vector<std::uint32_t> localTriangle;
  std::vector<MeshEdge> shared;  // from the big chart's side

  TwoCharts(HalfEdgeMesh whole, std::vector<std::uint32_t> bigTriangles, std::vector<std::uint32_t> smallTriangles)
      : mesh(std::move(whole)),
        big(flatChart(mesh, bigTriangles)),
        small(flatChart(mesh, smallTriangles)),
        localTriangle(mesh.size()) {
    std::iota(localTriangle.begin(), localTriangle.end(), 0u);
    for (const std::uint32_t t : bigTriangles)
      for (std::uint32_t k = 0; k < 3; ++k)
        if (std::count(smallTriangles.begin(), smallTriangles.end(), static_cast<std::uint32_t>(mesh.neighbour(t, k))) >
            0)
          shared.push_back({t, k});
  }

  ChartSheet sheet() { return ChartSheet(mesh, {&big, &small}, localTriangle, {}); }
};

TEST(ChartSheet, AStripThatWouldLieBesideAFarPartStaysApart) {
  // A wall of 20 x 4 with a post at its end, and a strip that stands up on the post's side; laid flat it runs back
  // along the wall, `gap` texels away.
  for (const double gap : {0.5, 3.0}) {
    TwoCharts c(meshOf({{0, 0, 0},
                        {20, 0, 0},
                        {20, 4, 0},
                        {0, 4, 0},
                        {24, 0, 0},
                        {24, 5 + gap, 0},
                        {20, 4 + gap, 0},
                        {20, 5 + gap, 0},
                        {20, 4 + gap, 20},
                        {20, 5 + gap, 20}},
                       {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}, {4, 5, 2}, {2, 5, 6}, {6, 5, 7}, {6, 7, 9}, {6, 9, 8}}),
                {0, 1, 2, 3, 4, 5}, {6, 7});
    for (std::size_t i = 0; i < c.small.uvs.size(); ++i) c.small.uvs[i].x = 20 - c.small.mesh.points[i].z;
    ASSERT_EQ(c.shared.size(), 1u);
    const ChartSheet sheet = c.sheet();
    EXPECT_EQ(sheet.mayJoin(0, 1, sheet.fits(c.shared, 1.0).at(0), MergeOptions()), gap > 2);
  }
}

TEST(ChartRim, SeesLegsThatAreNearOnThePageAloneAndNotSlitsOfTheSurface) {
  // Two legs of a U, 20 texels long, `near` apart on the page and `far` apart on the surface.
  const auto mixes = [](double near, double far) {
    ChartRim rim;
    rim.add({{0, 0}, {20, 0}, {0, 0, 0}, {20, 0, 0}});
    return rim.mixesWith({{20, near}, {0, near}, {20, far, 0}, {0, far, 0}});
  };
  EXPECT_TRUE(mixes(0.5, 10));
  EXPECT_TRUE(mixes(1.0, 10));
  EXPECT_FALSE(mixes(0.5, 0.5));  // a slit of the surface itself
  EXPECT_FALSE(mixes(2.5, 10));
}

TEST(ChartRim, SeesAVThatOpensOnTheSurfaceOnly) {
  ChartRim rim;
  rim.add({{0, 0}, {30, 0}, {0, 0, 0}, {30, 0, 0}});
  // 1 texel of opening at the end of 30 on the page, but 30 on the surface.
  EXPECT_TRUE(rim.mixesWith({{0, 0}, {30, 1}, {0, 0, 0}, {0, 30, 0}}));
  EXPECT_FALSE(rim.mixesWith({{0, 0}, {30, 1}, {0, 0, 0}, {30, 1, 0}}));
}

}  // namespace
}  // namespace lumel
