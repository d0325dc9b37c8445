// Layouts that are remembered from one bake to the next.
#include "lightmap/atlas/atlas.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "tests/lightmap/chart_checks.h"
#include "tests/lightmap/test_shapes.h"
#include "tests/mentions.h"

namespace lumel {
namespace {

RememberedLayout layoutOf(const Atlas& atlas, const AtlasOptions& options) {
  RememberedLayout layout{atlas.chartDensity,
                          atlas.chartScale,
                          options.pageSize,
                          options.padding,
                          options.blockAlign,
                          options.maxStretch,
                          {}};
  for (const Chart& chart : atlas.charts) {
    const int page = atlas.surfaces[static_cast<std::size_t>(chart.surface)].page;
    layout.charts.push_back({chart.key, {page, chart.quarterTurns, chart.x, chart.y}});
  }
  return layout;
}

/// Twelve boxes of different sizes, an object each.
Scene boxes() {
  Scene scene = box(Vec3(0), Vec3(1)).scene();
  for (int i = 1; i < 12; ++i) {
    const float size = 0.3f + 0.1f * static_cast<float>(i);
    const Scene other = box(Vec3(0), Vec3(size, 1, 2 * size)).scene();
    scene.meshes.push_back(other.meshes[0]);
    scene.instances.push_back(other.instances[0]);
    scene.instances.back().mesh = i;
    scene.instances.back().name = "box " + std::to_string(i);
  }
  return scene;
}

Expected<AtlasResult> atlasOf(const Scene& scene, const AtlasOptions& options) {
  Progress progress;
  return buildAtlas(scene, options, progress);
}

TEST(EarlierLayout, OnlyWhatChangedMoves) {
  Scene scene = boxes();
  for (const float density : {0.0f, 9.0f}) {
    AtlasOptions options{.texelsPerMeter = density, .pageSize = 128};
    const auto first = atlasOf(scene, options);
    ASSERT_TRUE(first);
    options.layout = std::make_shared<RememberedLayout>(layoutOf(first->atlas, options));
    Scene edited = scene;
    for (Vec3& p : edited.meshes[5].primitives[0].positions) p *= 0.9f;  // smaller, so that it fits beside the others
    edited.instances[3].worldFromObject[3] += Vec4(7, 0, 0, 0);
    std::swap(edited.instances[0], edited.instances[1]);
    const auto second = atlasOf(edited, options);
    ASSERT_TRUE(second);
    EXPECT_EQ(second->atlas.texelsPerMeter, first->atlas.texelsPerMeter);
    EXPECT_EQ(second->atlas.pages.size(), first->atlas.pages.size());
    const std::size_t changed = second->report.generatedCharts - second->report.keptCharts;
    EXPECT_GE(changed, 1u);
    EXPECT_LE(changed, 6u);
    EXPECT_GT(second->report.keptShare, 0.8);
    EXPECT_EQ(measureAtlas(second->atlas).overlapTexels, 0.0);
    std::map<std::string, std::vector<Vec2>> uvs;
    for (const Surface& s : first->atlas.surfaces)
      uvs[scene.instances[static_cast<std::size_t>(s.instance)].name] = s.lightmapUvs;
    for (const Surface& s : second->atlas.surfaces)
      if (const std::string& name = edited.instances[static_cast<std::size_t>(s.instance)].name; name != "box 5") {
        EXPECT_EQ(s.lightmapUvs, uvs[name]) << name;
      }
  }
}

TEST(EarlierLayout, ThatHasNoRoomGivesWayToANewOne) {
  Scene scene = boxes();
  AtlasOptions options{.pageSize = 128};
  const auto first = atlasOf(scene, options);
  ASSERT_TRUE(first);
  options.layout = std::make_shared<RememberedLayout>(layoutOf(first->atlas, options));
  scene.instances.push_back(scene.instances[0]);  // three walls of a large room
  scene.instances.back().name = "room";
  scene.meshes.push_back(box(Vec3(0), Vec3(4)).scene().meshes[0]);
  scene.instances.back().mesh = static_cast<int>(scene.meshes.size()) - 1;
  const auto second = atlasOf(scene, options);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->atlas.pages.size(), 1u);
  EXPECT_LT(second->atlas.texelsPerMeter, first->atlas.texelsPerMeter);
  EXPECT_EQ(second->report.keptCharts, 0u);
  ASSERT_EQ(second->report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(second->report.warnings[0], "no room"));
}

TEST(EarlierLayout, ByOtherRulesIsNotUsed) {
  const Scene scene = boxes();
  AtlasOptions options{.texelsPerMeter = 9, .pageSize = 128};
  const auto first = atlasOf(scene, options);
  ASSERT_TRUE(first);
  const auto layout = std::make_shared<RememberedLayout>(layoutOf(first->atlas, options));
  const auto warningWith = [&](AtlasOptions other) {
    other.layout = layout;
    const auto second = atlasOf(scene, other);
    EXPECT_TRUE(second && second->report.keptCharts == 0u && second->report.warnings.size() == 1u);
    return second && !second->report.warnings.empty() ? second->report.warnings[0] : std::string();
  };
  EXPECT_TRUE(mentions(warningWith({.texelsPerMeter = 9, .pageSize = 128, .padding = 3}), "padding"));
  EXPECT_TRUE(mentions(warningWith({.texelsPerMeter = 9, .pageSize = 256}), "page size"));
  EXPECT_TRUE(mentions(warningWith({.texelsPerMeter = 8, .pageSize = 128}), "density"));
  EXPECT_TRUE(mentions(warningWith({.texelsPerMeter = 9, .pageSize = 128, .blockAlign = 4}), "block"));
  EXPECT_TRUE(mentions(warningWith({.texelsPerMeter = 9, .pageSize = 128, .maxStretch = 1.1f}), "stretch"));
}

}  // namespace
}  // namespace lumel
