// Lightmap UVs that are each object's own: rectangles per instance; and triangles that are longer than a page.
#include <gtest/gtest.h>

#include <algorithm>

#include "lightmap/atlas/atlas.h"
#include "lightmap/atlas/split_triangles.h"
#include "tests/lightmap/chart_checks.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

/// A rectangle of `size` metres in the plane z = 0, whose TEXCOORD_1 spans the box.
Primitive rectangle(Vec2 size, Vec2 low, Vec2 high) {
  Primitive p;
  p.positions = {{0, 0, 0}, {size.x, 0, 0}, {size.x, size.y, 0}, {0, size.y, 0}};
  p.normals.assign(4, Vec3(0, 0, 1));
  p.indices = {0, 1, 2, 0, 2, 3};
  p.uvSets = {{}, {{low.x, high.y}, {high.x, high.y}, {high.x, low.y}, {low.x, low.y}}};
  return p;
}

Scene rowOf(const Primitive& primitive, int count) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes = {{"tile", {primitive}}};
  for (int i = 0; i < count; ++i) {
    Instance instance;
    instance.name = "tile " + std::to_string(i);
    instance.worldFromObject[3] = Vec4(3.0f * static_cast<float>(i), 0, 0, 1);
    scene.instances.push_back(instance);
  }
  return scene;
}

AtlasResult atlasOf(const Scene& scene, float texelsPerMeter, int pageSize, UvSource source = UvSource::Auto,
                    std::shared_ptr<const RememberedLayout> layout = {}) {
  AtlasOptions options;
  options.uvSource = source;
  options.texelsPerMeter = texelsPerMeter;
  options.pageSize = pageSize;
  options.layout = std::move(layout);
  Progress progress;
  Expected<AtlasResult> result = buildAtlas(scene, options, progress);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : AtlasResult();
}

/// The box on the page, in texels, around the UVs of an instance.
std::array<Vec2d, 2> boxOf(const Atlas& atlas, int instance) {
  Vec2d low(1e9), high(-1e9);
  for (const Surface& s : atlas.surfaces)
    if (s.instance == instance)
      for (const Vec2& uv : s.lightmapUvs) {
        const Page& page = atlas.pages[static_cast<std::size_t>(s.page)];
        low = glm::min(low, Vec2d(uv) * Vec2d(page.width, page.height));
        high = glm::max(high, Vec2d(uv) * Vec2d(page.width, page.height));
      }
  return {low, high};
}

TEST(ObjectUvs, InstancesShareAPageAtTheDensityAskedFor) {
  // 64 squares of 16 texels, with a gap of 2 and a border of 1: 8 x 18 texels a side.
  const Scene scene = rowOf(rectangle({1, 1}, Vec2(0.05f), Vec2(0.95f)), 64);
  const AtlasResult result = atlasOf(scene, 16, 256);
  const Atlas& atlas = result.atlas;
  EXPECT_EQ(result.report.objectsWithOwnUvs, 64u);
  EXPECT_EQ(result.report.generatedCharts, 0u);
  EXPECT_TRUE(result.report.warnings.empty());
  ASSERT_EQ(atlas.pages.size(), 1u);
  ASSERT_EQ(atlas.surfaces.size(), 64u);
  const AtlasFigures figures = measureAtlas(atlas);
  EXPECT_EQ(figures.overlapTexels, 0.0);
  EXPECT_EQ(figures.outside, 0u);
  // Whole texels already: only the rounding of float UVs is left.
  EXPECT_NEAR(figures.minDensity, 16, 1e-3);
  EXPECT_NEAR(figures.maxDensity, 16, 1e-3);
  for (int a = 0; a < 64; ++a)
    for (int b = 0; b < a; ++b) {
      const auto first = boxOf(atlas, a), second = boxOf(atlas, b);
      const Vec2d apart = glm::max(first[0] - second[1], second[0] - first[1]);
      // Padding of 2 texels, less the rounding of float UVs.
      EXPECT_GE(std::max(apart.x, apart.y), 2 - 1e-3) << a << ' ' << b;
    }
}

TEST(ObjectUvs, EveryVertexIsWhereTheTableSays) {
  const Scene scene = rowOf(rectangle({1, 2}, {0.1f, 0.2f}, {0.9f, 0.6f}), 5);
  const Atlas atlas = atlasOf(scene, 10, 64).atlas;
  ASSERT_EQ(atlas.places.size(), 5u);
  for (const Surface& s : atlas.surfaces) {
    const LightmapPlace& place = atlas.places[static_cast<std::size_t>(s.instance)];
    EXPECT_EQ(place.page, s.page);
    for (std::size_t i = 0; i < s.positions.size(); ++i)
      EXPECT_EQ(s.lightmapUvs[i], place.apply(scene.primitive(0, 0).uvSets[1][s.sourceVertex[i]]));
  }
}

TEST(ObjectUvs, RectanglesAreAsLongAsTheSurfaceInBothDirections) {
  // 8 m x 2 m in a square of UVs, at 4 texels per metre.
  const Atlas atlas = atlasOf(rowOf(rectangle({8, 2}, Vec2(0), Vec2(1)), 3), 4, 64).atlas;
  for (int i = 0; i < 3; ++i) {
    const auto box = boxOf(atlas, i);
    EXPECT_NEAR(box[1].x - box[0].x, 32, 1e-3);
    EXPECT_NEAR(box[1].y - box[0].y, 8, 1e-3);
  }
}

TEST(ObjectUvs, AutoTakesUvsThatDoNotOverlapForPlacesOnAPage) {
  Scene scene = rowOf(rectangle({1, 1}, {0, 0}, {0.5f, 0.5f}), 1);
  scene.meshes.push_back({"other", {rectangle({1, 1}, {0.5f, 0}, {1, 0.5f})}});
  scene.instances.push_back(scene.instances[0]);
  scene.instances[1].mesh = 1;
  const AtlasResult asPlaces = atlasOf(scene, 16, 64);
  EXPECT_EQ(asPlaces.report.objectsWithOwnUvs, 0u);
  EXPECT_EQ(asPlaces.atlas.surfaces.at(1).lightmapUvs, scene.primitive(1, 0).uvSets[1]);
  EXPECT_EQ(atlasOf(scene, 16, 64, UvSource::Object).report.objectsWithOwnUvs, 2u);
  // One more of a kind overlaps the first.
  scene.instances.push_back(scene.instances[0]);
  EXPECT_EQ(atlasOf(scene, 16, 64).report.objectsWithOwnUvs, 3u);
}

TEST(ObjectUvs, MarginsThatAreTooSmallAreNamed) {
  // Two halves with 0.02 of the UVs between them: at 100 texels a side two texels, at 10 a fifth of one.
  Primitive p = rectangle({1, 2}, {0, 0}, {0.49f, 1});
  Primitive other = rectangle({1, 2}, {0.51f, 0}, {1, 1});
  for (Vec3& q : other.positions) q.z = 1;
  Scene scene = rowOf(p, 2);
  scene.meshes[0].primitives.push_back(other);
  EXPECT_TRUE(atlasOf(scene, 50, 512).report.warnings.empty());
  const AtlasResult coarse = atlasOf(scene, 5, 512);
  ASSERT_EQ(coarse.report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(coarse.report.warnings[0], "in 2 objects"));
}

TEST(ObjectUvs, ARectangleLargerThanAPageGetsFewerTexels) {
  const AtlasResult result = atlasOf(rowOf(rectangle({10, 5}, Vec2(0), Vec2(1)), 2), 16, 64);
  EXPECT_EQ(result.report.warnings.size(), 2u);
  const AtlasFigures figures = measureAtlas(result.atlas);
  EXPECT_EQ(figures.outside, 0u);
  EXPECT_EQ(figures.overlapTexels, 0.0);
  // 61 texels of a page of 64 for 10 m.
  EXPECT_NEAR(figures.maxDensity, 6.1, 0.1);
}

TEST(ObjectUvs, AnEarlierLayoutKeepsRectangles) {
  const Scene scene = rowOf(rectangle({1, 1}, Vec2(0), Vec2(1)), 4);
  const Atlas before = atlasOf(scene, 16, 64).atlas;
  auto layout = std::make_shared<RememberedLayout>();
  layout->chartDensity = before.chartDensity;
  layout->scale = before.chartScale;
  layout->pageSize = 64;
  layout->padding = 2;
  layout->maxStretch = AtlasOptions().maxStretch;
  for (const Chart& chart : before.charts)
    layout->charts.push_back({chart.key, {0, chart.quarterTurns, chart.x, chart.y}});
  // A fifth tile comes, and the first moves.
  Scene edited = rowOf(rectangle({1, 1}, Vec2(0), Vec2(1)), 5);
  edited.instances[0].worldFromObject[3] = Vec4(0, 9, 0, 1);
  const AtlasResult after = atlasOf(edited, 16, 64, UvSource::Auto, layout);
  EXPECT_EQ(after.report.keptCharts, 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(after.atlas.charts[i].x, before.charts[i].x);
    EXPECT_EQ(after.atlas.charts[i].y, before.charts[i].y);
  }
}

TEST(LongTriangles, AreSplitUntilTheyFitAPage) {
  Scene scene = rowOf(rectangle({100, 100}, Vec2(0), Vec2(1)), 1);
  scene.meshes[0].primitives[0].uvSets.clear();
  AtlasOptions options;
  options.texelsPerMeter = 16;
  options.pageSize = 256;
  const SplitReport split = splitLongTriangles(scene, options);
  EXPECT_EQ(split.triangles, 2u);
  EXPECT_EQ(split.pieces, scene.primitive(0, 0).triangleCount());
  const AtlasResult result = atlasOf(scene, 16, 256);
  const AtlasFigures figures = measureAtlas(result.atlas);
  EXPECT_EQ(figures.outside, 0u);
  EXPECT_EQ(figures.overlapTexels, 0.0);
  // Pieces are sums of floats that differ in the seventh digit.
  EXPECT_NEAR(figures.surface, 10000, 0.01);
  // Charts give up to 8% to end on whole texels.
  EXPECT_GT(figures.minDensity, 16 * 0.92);
  EXPECT_LT(figures.maxDensity, 16 * 1.001);
}

TEST(LongTriangles, NeighboursAreCutAlikeAndShortOnesStay) {
  // A long triangle, and a second primitive that meets its long edge with vertices of its own.
  Primitive a;
  a.positions = {{0, 0, 0}, {40, 0, 0}, {0, 3, 0}};
  a.normals.assign(3, Vec3(0, 0, 1));
  a.indices = {0, 1, 2};
  Primitive b = a;
  b.positions = {{40, 0, 0}, {0, 0, 0}, {20, -3, 0}};
  Primitive c = a;
  c.positions = {{0, 9, 0}, {1, 9, 0}, {0, 10, 0}};
  Scene scene = rowOf(a, 1);
  scene.meshes[0].primitives = {a, b, c};
  AtlasOptions options;
  options.texelsPerMeter = 10;
  options.pageSize = 128;
  EXPECT_EQ(splitLongTriangles(scene, options).triangles, 2u);
  EXPECT_EQ(scene.primitive(0, 2).indices, c.indices);
  EXPECT_EQ(scene.primitive(0, 2).positions, c.positions);
  const auto onEdge = [](const Primitive& p) {
    std::vector<float> xs;
    for (const Vec3& q : p.positions)
      if (q.y == 0) xs.push_back(q.x);
    std::sort(xs.begin(), xs.end());
    return xs;
  };
  EXPECT_EQ(onEdge(scene.primitive(0, 0)), onEdge(scene.primitive(0, 1)));
  EXPECT_GT(onEdge(scene.primitive(0, 0)).size(), 2u);
}

TEST(LongTriangles, NothingIsSplitWithoutADensityOrBeyondAThousandPages) {
  Scene scene = rowOf(rectangle({100, 100}, Vec2(0), Vec2(1)), 1);
  scene.meshes[0].primitives[0].uvSets.clear();
  AtlasOptions options;
  options.pageSize = 256;
  EXPECT_EQ(splitLongTriangles(scene, options).triangles, 0u);
  options.texelsPerMeter = 100;  // 1526 pages
  EXPECT_EQ(splitLongTriangles(scene, options).triangles, 0u);
}

}  // namespace
}  // namespace lumel
