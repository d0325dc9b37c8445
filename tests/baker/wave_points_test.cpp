#include "baker/gather/waves/wave_points.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A square sheet of cells x cells bumpy quads with smooth normals, on a page of its own of texels x texels.
TestScene bumpySheet(int cells, int texels) {
  TestScene test;
  Primitive primitive;
  Surface surface;
  const auto count = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t y = 0; y < count; ++y)
    for (std::uint32_t x = 0; x < count; ++x) {
      const Vec2 uv(static_cast<float>(x) / static_cast<float>(cells),
                    static_cast<float>(y) / static_cast<float>(cells));
      surface.positions.emplace_back(4.0f * uv.x, -4.0f * uv.y, 0.3f * std::sin(5.0f * uv.x) * std::cos(4.0f * uv.y));
      surface.normals.push_back(glm::normalize(Vec3(-0.375f * std::cos(5.0f * uv.x) * std::cos(4.0f * uv.y),
                                                    -0.3f * std::sin(5.0f * uv.x) * std::sin(4.0f * uv.y), 1.0f)));
      surface.tangents.emplace_back(1.0f, 0.0f, 0.0f, 1.0f);
      surface.lightmapUvs.push_back(uv);
      surface.sourceVertex.push_back(y * count + x);
    }
  for (std::uint32_t y = 0; y + 1 < count; ++y)
    for (std::uint32_t x = 0; x + 1 < count; ++x) {
      const std::uint32_t corner = y * count + x;
      for (const std::uint32_t i : {corner, corner + count, corner + 1, corner + 1, corner + count, corner + count + 1})
        surface.indices.push_back(i);
    }
  for (std::uint32_t t = 0; t < surface.indices.size() / 3; ++t) surface.sourceTriangle.push_back(t);
  surface.charts.assign(surface.indices.size() / 3, 0);
  primitive.positions = surface.positions;
  primitive.normals = surface.normals;
  primitive.indices = surface.indices;
  test.scene.meshes.push_back({"sheet", {primitive}});
  test.scene.instances.emplace_back();
  test.atlas.pages.push_back({texels, texels});
  test.atlas.charts.push_back({0, 1.0f});
  test.atlas.surfaces.push_back(surface);
  return test;
}

/// Draws all texels' points and compares them with those of their footprints, one by one.
void compareWithFootprints(int cells, int texels) {
  const TestScene test = bumpySheet(cells, texels);
  const PageTexels page = findTexels(test.atlas)[0];
  std::vector<std::string> notes;
  const Materials materials(test.scene, true, notes);
  auto rays = RayScene::build(test.scene, materials);
  ASSERT_TRUE(rays);
  constexpr std::uint32_t kPattern = 3, kFirst = 32;
  TexelFootprint footprint;
  int points = 0, elsewhere = 0;
  for (std::size_t first = 0; first < page.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, page.size() - first);
    WavePoints drawn(**rays, test.atlas, page, first, count);
    std::array<TexelSampler, kLanes> samplers;
    for (std::size_t lane = 0; lane < count; ++lane)
      samplers[lane] = {1, 0, page.coords[first + lane].x, page.coords[first + lane].y};
    drawn.draw(samplers, kPattern, kFirst, WavePoints::kMost);
    for (std::size_t lane = 0; lane < count; ++lane) {
      EXPECT_NEAR(drawn.area(lane), footprint.clip(test.atlas, page, first + lane), 1e-12);
      for (std::uint32_t i = 0; i < WavePoints::kMost; ++i, ++points) {
        const SurfacePoint expected = footprint.sample(samplers[lane].get2D(kFirst + i, kPattern));
        // Between two pieces floats may choose another one than doubles.
        if (!(drawn.place(lane, i).triangle == expected.triangle)) {
          ++elsewhere;
          continue;
        }
        const PointLanes at = drawn[i];
        EXPECT_LT(glm::length(at.p[lane] - expected.position), 4e-5f);
        EXPECT_LT(glm::length(at.frame[lane].n - expected.frame.n), 1e-4f);
        EXPECT_LT(glm::length(at.frame[lane].t - expected.frame.t), 1e-4f);
        EXPECT_LT(glm::length(at.frame[lane].b - expected.frame.b), 1e-4f);
        EXPECT_LT(glm::length(at.ng[lane] - expected.geometricNormal), 1e-6f);
        // Off the surface on its front by rounding alone; what is rounded swells by less than its bumps are high.
        const float height = glm::dot(at.rayStart[lane] - at.p[lane], expected.geometricNormal);
        EXPECT_GT(height, 0.0f);
        EXPECT_LT(height, 1e-4f);
        const float lift = glm::dot(at.lift[lane], expected.geometricNormal);
        EXPECT_TRUE(at.lift[lane] == Vec3(0.0f) || lift > height);
        EXPECT_LT(lift, 0.3f);
      }
    }
  }
  EXPECT_GT(points, 1000);
  EXPECT_LT(elsewhere, points / 500);
}

TEST(WavePoints, AreThoseOfFootprints) {
  compareWithFootprints(3, 40);   // most texels lie within one triangle
  compareWithFootprints(24, 16);  // all are shared by several
}

TEST(WavePoints, LanesLeftOutHoldZeros) {
  const TestScene test = bumpySheet(3, 8);
  const PageTexels page = findTexels(test.atlas)[0];
  std::vector<std::string> notes;
  const Materials materials(test.scene, true, notes);
  auto rays = RayScene::build(test.scene, materials);
  ASSERT_TRUE(rays);
  WavePoints drawn(**rays, test.atlas, page, 0, kLanes);
  drawn.leaveOut(5);
  drawn.draw({}, 0, 0, 16);
  for (std::uint32_t i = 0; i < 16; ++i) {
    EXPECT_EQ(drawn[i].active[5], 0);
    EXPECT_EQ(drawn[i].frame[5].n, Vec3(0.0f));
    EXPECT_EQ(drawn[i].ng[5], Vec3(0.0f));
    EXPECT_NE(drawn[i].frame[4].n, Vec3(0.0f));
  }
}

}  // namespace
}  // namespace lumel
