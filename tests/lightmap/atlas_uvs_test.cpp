// Lightmap UVs that the scene brings along.
#include "lightmap/atlas/atlas.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

/// A unit square on the floor at x, whose TEXCOORD_1 spans the rectangle.
Primitive litSquare(float x, Vec2 low, Vec2 high) {
  Primitive p;
  p.positions = {{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0}};
  p.normals.assign(4, Vec3(0, 0, 1));
  p.indices = {0, 1, 2, 0, 2, 3};
  p.uvSets = {{}, {{low.x, high.y}, {high.x, high.y}, {high.x, low.y}, {low.x, low.y}}};
  return p;
}

Scene litScene(const std::vector<Primitive>& primitives) {
  Scene scene;
  scene.materials.emplace_back();
  for (const Primitive& p : primitives) {
    scene.meshes.push_back({"m", {p}});
    Instance instance;
    instance.name = "object " + std::to_string(scene.instances.size());
    instance.mesh = static_cast<int>(scene.instances.size());
    scene.instances.push_back(instance);
  }
  return scene;
}

Expected<AtlasResult> withSceneUvs(const Scene& scene, UvSource source) {
  AtlasOptions options;
  options.uvSource = source;
  options.pageSize = 64;
  Progress progress;
  return buildAtlas(scene, options, progress);
}

TEST(SceneUvs, AreUsedAsTheyAreAndShareAPageWhereTheyCan) {
  const Scene scene =
      litScene({litSquare(0, {0, 0}, {0.5f, 0.5f}), litSquare(2, {0.5f, 0}, {1, 0.5f}), litSquare(4, {0, 0}, {1, 1})});
  const Expected<AtlasResult> result = withSceneUvs(scene, UvSource::Scene);
  ASSERT_TRUE(result);
  const Atlas& atlas = result->atlas;
  ASSERT_EQ(atlas.surfaces.size(), 3u);
  EXPECT_EQ(atlas.pages.size(), 2u);
  EXPECT_EQ(atlas.surfaces[0].page, 0);
  EXPECT_EQ(atlas.surfaces[1].page, 0);
  EXPECT_EQ(atlas.surfaces[2].page, 1);
  EXPECT_EQ(atlas.texelsPerMeter, 0.0f);
  for (const Surface& s : atlas.surfaces)
    for (std::size_t i = 0; i < s.positions.size(); ++i) {
      EXPECT_EQ(s.lightmapUvs[i], scene.primitive(s.instance, 0).uvSets[1][s.sourceVertex[i]]);
      EXPECT_EQ(s.tangents[i], Vec4(1, 0, 0, 1));
    }
  EXPECT_NEAR(atlas.charts[0].texelsPerMeter, 32, 1e-3);
  EXPECT_NEAR(atlas.charts[2].texelsPerMeter, 64, 1e-3);
}

TEST(SceneUvs, ThatOverlapAreReportedAndReplaced) {
  Primitive p = litSquare(0, {0, 0}, {1, 1});
  for (const std::uint32_t i : {0u, 1u, 2u}) p.indices.push_back(i);
  const Scene scene = litScene({p, litSquare(2, {0, 0}, {1, 1})});
  const Expected<AtlasResult> scened = withSceneUvs(scene, UvSource::Scene);
  ASSERT_FALSE(scened);
  EXPECT_EQ(scened.error().kind, ErrorKind::Input);
  const Expected<AtlasResult> result = withSceneUvs(scene, UvSource::Auto);
  ASSERT_TRUE(result);
  ASSERT_EQ(result->report.sceneUvs.size(), 2u);
  EXPECT_FALSE(result->report.sceneUvs[0].valid);
  EXPECT_NEAR(result->report.sceneUvs[0].overlapTexels, 64 * 64 / 2, 64);
  EXPECT_TRUE(result->report.sceneUvs[1].valid);
  EXPECT_EQ(result->report.warnings.size(), 1u);
  EXPECT_EQ(measureAtlas(result->atlas).overlapTexels, 0.0);
  // No denser than the scene's own lightmap of 64 texels per metre.
  EXPECT_LE(result->atlas.texelsPerMeter, 64.001f);
}

TEST(SceneUvs, OutsideThePageOrNotFiniteAreInvalid) {
  for (const float bad : {1.5f, -0.2f, std::numeric_limits<float>::quiet_NaN()}) {
    Primitive p = litSquare(0, {0, 0}, {1, 1});
    p.uvSets[1][2].x = bad;
    const Expected<AtlasResult> result = withSceneUvs(litScene({p}), UvSource::Auto);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->report.sceneUvs.at(0).outOfRangeVertices, 1u);
    EXPECT_FALSE(result->report.sceneUvs[0].valid);
    EXPECT_EQ(result->report.generatedCharts, 1u);
  }
}

TEST(SceneUvs, ThatAreTooNarrowForTexelsAreReportedAndReplaced) {
  // 1e-6 of a page of 64 texels.
  const Scene scene = litScene({litSquare(0, {0, 0}, {1e-6f, 1e-6f})});
  const Expected<AtlasResult> result = withSceneUvs(scene, UvSource::Auto);
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->report.sceneUvs.at(0).valid);
  EXPECT_EQ(result->report.generatedCharts, 1u);
  ASSERT_EQ(result->report.warnings.size(), 1u);
  EXPECT_NE(result->report.warnings[0].find("all UVs lie within 6.4e-05 texels"), std::string::npos)
      << result->report.warnings[0];
  EXPECT_FALSE(withSceneUvs(scene, UvSource::Scene));
}

TEST(SceneUvs, MirroredChartsGetALeftHandedFrame) {
  Primitive p = litSquare(0, {0, 0}, {1, 1});
  for (Vec2& uv : p.uvSets[1]) uv.x = 1 - uv.x;
  const Expected<AtlasResult> result = withSceneUvs(litScene({p}), UvSource::Auto);
  ASSERT_TRUE(result);
  for (const Vec4& t : result->atlas.surfaces.at(0).tangents) EXPECT_EQ(t, Vec4(-1, 0, 0, -1));
}

}  // namespace
}  // namespace lumel
