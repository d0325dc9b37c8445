#include "lightmap/atlas/atlas.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lightmap/pack/pack_shape.h"
#include "scene/base/parallel.h"
#include "tests/lightmap/chart_checks.h"
#include "tests/lightmap/test_shapes.h"

namespace lumel {
namespace {

TEST(BakeFrame, OfALightmapPointsAlongItsUvs) {
  const AtlasResult result = chartsOf(torus(48, 24).scene(), 20);
  const Atlas& atlas = result.atlas;
  for (const Surface& s : atlas.surfaces)
    for (std::size_t t = 0; t < s.triangleCount(); ++t) {
      std::array<Vec3d, 3> p;
      std::array<Vec2d, 3> uv;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = s.positions[s.indices[3 * t + k]];
        uv[k] = s.lightmapUvs[s.indices[3 * t + k]];
      }
      // Moving by t on the surface moves right in the image, by b = w * cross(n, t) up: v decreases.
      const Vec3d e1 = p[1] - p[0], e2 = p[2] - p[0];
      const Vec2d d1 = uv[1] - uv[0], d2 = uv[2] - uv[0];
      const double det = d1.x * d2.y - d1.y * d2.x;
      const Vec3d right = glm::normalize((e1 * d2.y - e2 * d1.y) / det);
      const Vec3d up = glm::normalize((e1 * d2.x - e2 * d1.x) / det);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = s.indices[3 * t + k];
        const Frame frame = frameFromTangent(s.normals[v], s.tangents[v]);
        EXPECT_GT(glm::dot(Vec3d(frame.t), right), 0.8);
        EXPECT_GT(glm::dot(Vec3d(frame.b), up), 0.8);
      }
    }
}

TEST(BakeFrame, MirroringInstanceKeepsTheTransformedBitangent) {
  Scene scene = sceneOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {0, 1, 2}, std::vector<Vec3>(3, Vec3(0, 0, 1)));
  scene.meshes[0].primitives[0].tangents.assign(3, Vec4(0.6f, 0.8f, 0, -1));
  scene.instances[0].worldFromObject[0][0] = -2;
  const AtlasResult result = chartsOf(scene, 40);
  const Surface& s = result.atlas.surfaces.at(0);
  const Vec3 bObject = -glm::cross(Vec3(0, 0, 1), Vec3(0.6f, 0.8f, 0));
  const Vec3 bWorld = glm::normalize(Mat3(scene.instances[0].worldFromObject) * bObject);
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const Vec3 b = s.tangents[i].w * glm::cross(s.normals[i], Vec3(s.tangents[i]));
    // The bitangent of a frame made orthonormal again: on the same side, though not parallel under uneven scale.
    EXPECT_GT(glm::dot(b, bWorld), 0.5f);
    EXPECT_NEAR(glm::length(Vec3(s.tangents[i])), 1.0, 1e-6);
    EXPECT_EQ(s.normals[i], Vec3(0, 0, 1));
  }
  const Vec3 p0 = s.positions[s.indices[0]], p1 = s.positions[s.indices[1]], p2 = s.positions[s.indices[2]];
  EXPECT_GT(glm::cross(p1 - p0, p2 - p0).z, 0) << "wound for the front in the world";
}

TEST(Instances, ShareOneFlatteningAndKeepTheirOwnPlaces) {
  Scene scene = torus(32, 16).scene();
  scene.instances.push_back(scene.instances[0]);
  scene.instances[1].name = "second";
  scene.instances[1].worldFromObject[3] = Vec4(10, 0, 0, 1);
  const AtlasResult result = chartsOf(scene, 15);
  ASSERT_EQ(result.atlas.surfaces.size(), 2u);
  const Surface& a = result.atlas.surfaces[0];
  const Surface& b = result.atlas.surfaces[1];
  ASSERT_EQ(a.indices.size(), b.indices.size());
  EXPECT_NE(a.lightmapUvs, b.lightmapUvs);
  for (std::size_t i = 0; i < a.charts.size(); ++i)
    EXPECT_EQ(b.charts[i] - a.charts[i], result.atlas.charts.size() / 2);
  EXPECT_EQ(measureAtlas(result.atlas).overlapTexels, 0.0);
}

TEST(Density, OfAnObjectIsScaledByItsSetting) {
  Scene scene = box(Vec3(0), Vec3(1)).scene();
  scene.instances.push_back(scene.instances[0]);
  scene.instances[1].settings.texelDensityScale = 2;
  const AtlasResult result = chartsOf(scene, 20);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_NEAR(f.minDensity, 20, 0.01);
  EXPECT_NEAR(f.maxDensity, 40, 0.01);
}

TEST(Density, IsFoundSoThatOnePageIsFilled) {
  Shape boxes = box(Vec3(0), Vec3(3, 2, 1));
  for (int i = 1; i < 20; ++i) boxes.add(box(Vec3(4 * i, 0, 0), Vec3(4 * i + 2, 1, 0.5f)));
  const AtlasResult result = chartsOf(boxes.scene(), 0, 256);
  ASSERT_EQ(result.atlas.pages.size(), 1u);
  EXPECT_EQ(result.atlas.pages[0].width, 256);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_GT(f.coveredTexels, 0.7 * 256 * 256);  // rectangles of many sizes pack that well with gutters of 2
  EXPECT_GE(f.minDensity / result.atlas.texelsPerMeter, 0.98 * (1 - kMostSnap));
  EXPECT_LE(f.maxDensity / result.atlas.texelsPerMeter, 1.02);
}

TEST(Density, BordersOfStraightWallsAreMovedToWholeTexels) {
  Shape wall;
  wall.positions = {{0, 0, 0}, {3, 0, 0}, {3, 2, 0}, {0, 2, 0}};
  wall.indices = {0, 1, 2, 0, 2, 3};
  const AtlasResult result = chartsOf(wall.scene(), 10.15f, 64);  // 30.45 x 20.3 texels
  ASSERT_EQ(result.atlas.surfaces.size(), 1u);
  const Page page = result.atlas.pages[0];
  for (const Vec2& uv : result.atlas.surfaces[0].lightmapUvs) {
    const Vec2 texel = uv * Vec2(page.width, page.height);
    EXPECT_NEAR(texel.x, std::round(texel.x), 1e-4);
    EXPECT_NEAR(texel.y, std::round(texel.y), 1e-4);
  }
  EXPECT_EQ(measureAtlas(result.atlas).coveredTexels, 30 * 20);
  EXPECT_NEAR(result.atlas.charts[0].texelsPerMeter, std::sqrt(30.0 / 3 * 20.0 / 2), 1e-4);
}

TEST(Density, ATriangleLargerThanAPageIsAUsageError) {
  Shape s;
  s.positions = {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}};
  s.indices = {0, 1, 2};
  AtlasOptions options;
  options.pageSize = 256;
  Progress progress;
  // Of a density far too high at once: its chart would have 10^16 texels.
  for (const float density : {4.0f, 20.0f, 1e6f}) {
    options.texelsPerMeter = density;
    const Expected<AtlasResult> result = buildAtlas(s.scene(), options, progress);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::Usage);
  }
  // A sliver whose area would fill the page at such a density is no mistake where the density is looked for.
  s.positions[2] = {0, 1e-4f, 0};
  options.texelsPerMeter = 0;
  EXPECT_TRUE(buildAtlas(s.scene(), options, progress));
}

TEST(Atlas, OfAnEmptySceneIsEmpty) {
  const AtlasResult result = chartsOf(Scene{}, 20);
  EXPECT_TRUE(result.atlas.surfaces.empty());
  EXPECT_TRUE(result.atlas.pages.empty());
}

TEST(Atlas, IsTheSameForAnyThreadCount) {
  Shape s = torus(40, 20);
  s.add(sphere(24, 12));
  const auto uvs = [&](int threads) {
    const ThreadLimit limit(threads);
    const AtlasResult result = chartsOf(s.scene(), 20);
    return result.atlas.surfaces.at(0).lightmapUvs;
  };
  EXPECT_EQ(uvs(1), uvs(4));
}

}  // namespace
}  // namespace lumel
