#include "lightmap/atlas/lint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

/// Two unit squares of 8 x 8 texels on a page of 32, side by side with 2 texels between.
struct Fixture {
  Scene scene = sceneOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}},
                        {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7}, std::vector<Vec3>(8, Vec3(0, 0, 1)));
  Atlas atlas = chartsOf(scene, 8, 32).atlas;

  Fixture() {
    atlas.pages = {{32, 32}};
    place(0, {1, 1}, 8);
    place(1, {11, 1}, 8);
  }

  /// Puts square `which` with its lower left corner's texels at `low`.
  void place(std::uint32_t which, Vec2 low, float size) {
    Surface& s = atlas.surfaces.at(0);
    for (std::size_t i = 0; i < s.positions.size(); ++i)
      if (s.sourceVertex[i] / 4 == which) {
        const Vec3 p = s.positions[i] - Vec3(2.0f * static_cast<float>(which), 0, 0);
        s.lightmapUvs[i] = (low + size * Vec2(p.x, 1 - p.y)) / 32.0f;
      }
  }

  LintFinding find(const std::string& id) const {
    for (const LintFinding& f : lintAtlas(scene, atlas, 2).findings)
      if (f.id == id) return f;
    ADD_FAILURE() << "no finding " << id;
    return {};
  }
};

TEST(Lint, FindsNothingInASoundAtlas) {
  const Fixture f;
  const LintReport report = lintAtlas(f.scene, f.atlas, 2);
  EXPECT_EQ(report.findings.size(), 11u);
  for (const LintFinding& finding : report.findings) EXPECT_EQ(finding.count, 0) << finding.id;
  EXPECT_EQ(report.coveredTexels, 128);
  EXPECT_EQ(report.pageTexels, 1024);
  EXPECT_EQ(report.mapBytes, 1024 * 24);
  EXPECT_EQ(lintText(report).size(), 1u);
}

TEST(Lint, MeasuresOverlapAndNamesThePlace) {
  Fixture f;
  f.place(1, {5, 1}, 8);
  const LintFinding overlap = f.find("overlap");
  EXPECT_EQ(overlap.count, 4 * 8);
  EXPECT_EQ(overlap.level, LintLevel::Error);
  EXPECT_EQ(overlap.worst, "test, primitive 0");
  EXPECT_EQ(overlap.page, 0);
  EXPECT_EQ(f.find("gap").count, 2);
}

TEST(Lint, SeesChartsNearerThanThePadding) {
  Fixture f;
  f.place(1, {10, 1}, 8);
  EXPECT_EQ(f.find("gap").count, 2);
  EXPECT_EQ(f.find("overlap").count, 0);
}

TEST(Lint, SeesVerticesOffThePage) {
  Fixture f;
  f.place(1, {30, 1}, 8);
  EXPECT_EQ(f.find("out-of-range").count, 2);
}

TEST(Lint, SeesMirroredChartsAndFlippedTriangles) {
  Fixture f;
  f.place(1, {19, 1}, -8);  // turned by half a turn: not mirrored
  EXPECT_EQ(f.find("mirrored").count, 0);
  Surface& s = f.atlas.surfaces[0];
  for (std::size_t i = 0; i < s.positions.size(); ++i)
    if (s.sourceVertex[i] >= 4) s.lightmapUvs[i].x = 1 - s.lightmapUvs[i].x;
  EXPECT_EQ(f.find("mirrored").count, 1);
  EXPECT_EQ(f.find("flip").count, 0);
  for (std::size_t i = 0; i < s.positions.size(); ++i)
    if (s.sourceVertex[i] == 1) s.lightmapUvs[i] = Vec2(3, 5) / 32.0f;  // over the diagonal
  EXPECT_EQ(f.find("flip").count, 1);
}

TEST(Lint, SeesSmallAndUnevenlyDenseCharts) {
  Fixture f;
  f.place(1, {11, 1}, 0.5f);
  EXPECT_EQ(f.find("sub-texel").count, 1);
  EXPECT_EQ(f.find("tiny").count, 1);
  EXPECT_EQ(f.find("density").count, 2);  // both are off the mean of a dense and a sparse one
  f.place(1, {11, 1}, 0.0f);
  EXPECT_EQ(f.find("lost").count, 2);
}

TEST(Lint, SeesFramesThatBreakInsideAChart) {
  Fixture f;
  Surface& s = f.atlas.surfaces[0];
  // The diagonal's points of the first square doubled, with another tangent on the second triangle's side.
  for (std::size_t t = 0; t < s.triangleCount(); ++t) {
    if (s.sourceTriangle[t] != 1) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = s.indices[3 * t + k];
      s.indices[3 * t + k] = static_cast<std::uint32_t>(s.positions.size());
      s.positions.push_back(s.positions[v]);
      s.normals.push_back(s.normals[v]);
      s.tangents.push_back(Vec4(0, 1, 0, 1));
      s.lightmapUvs.push_back(s.lightmapUvs[v]);
      s.sourceVertex.push_back(s.sourceVertex[v]);
    }
  }
  EXPECT_EQ(f.find("frame-crossing").count, 1);
}

TEST(Lint, LetsSmallTurnsAddUpAroundAPoint) {
  // A fan of six triangles around a point, each with a frame 4 degrees on from its neighbour's: no edge breaks.
  std::vector<Vec3> points = {{0, 0, 0}};
  std::vector<std::uint32_t> indices;
  for (std::uint32_t k = 0; k < 6; ++k) {
    points.push_back(Vec3(std::cos(0.9f * static_cast<float>(k)), std::sin(0.9f * static_cast<float>(k)), 0));
    if (k > 0) indices.insert(indices.end(), {0, k, k + 1});
  }
  const Scene scene = sceneOf(points, indices);  // with vertices of its own for each triangle
  for (const float step : {4.0f, 6.0f}) {
    Atlas atlas = chartsOf(scene, 8, 32).atlas;
    ASSERT_EQ(atlas.charts.size(), 1u);
    Surface& s = atlas.surfaces.at(0);
    for (std::size_t t = 0; t < s.triangleCount(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const float turn = glm::radians(step * static_cast<float>(s.sourceTriangle[t]));
        s.tangents[s.indices[3 * t + k]] = Vec4(std::cos(turn), std::sin(turn), 0, 1);
      }
    for (const LintFinding& f : lintAtlas(scene, atlas, 2).findings) {
      if (f.id != "frame-crossing") continue;
      EXPECT_EQ(f.count, step > 5 ? 1 : 0);
    }
  }
}

TEST(Lint, SeesTexelsThatMixFarPartsOfAChart) {
  Fixture f;
  // The second square is now of the first one's chart, half a texel beside it, and 2 units of 8 texels away.
  f.place(1, {9.5f, 1}, 8);
  EXPECT_EQ(f.find("self-mixing").count, 0);  // of two charts: that is a gap
  for (std::uint32_t& chart : f.atlas.surfaces[0].charts) chart = 0;
  EXPECT_EQ(f.find("self-mixing").count, 0);  // texels 9 and 10 hold one part each
  f.place(1, {8.5f, 1}, 8);
  const LintFinding mixed = f.find("self-mixing");
  EXPECT_EQ(mixed.count, 8);
  EXPECT_EQ(mixed.x, 8);
  EXPECT_EQ(mixed.level, LintLevel::Warning);
}

TEST(ChartPicture, ShowsEachChartInItsColour) {
  const Fixture f;
  const Image image = chartPicture(f.atlas, 0);
  EXPECT_EQ(image.width, 32);
  EXPECT_NE(image.rgb(4, 4), Vec3(0.0f));
  EXPECT_NE(image.rgb(4, 4), image.rgb(14, 4));
  EXPECT_EQ(image.rgb(9, 4), Vec3(0.0f));
}

}  // namespace
}  // namespace lumel
