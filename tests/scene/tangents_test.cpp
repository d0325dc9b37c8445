#include <gtest/gtest.h>

#include "scene/triangles/tangents.h"
#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

const Vec3 kUp(0, 0, 1);

void expectNear(const Vec3& a, const Vec3& b, float tolerance = 1e-6f) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance);
}

Vec3 bitangent(const Vec4& t, const Vec3& n) { return t.w * glm::cross(n, Vec3(t)); }

TEST(Tangents, UprightImageGivesUAlongTAndGreenUp) {
  // Seen from +z the image stands upright: u right, v down.
  const std::vector<Vec3> p = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
  const std::vector<Vec2> uv = {{0, 1}, {1, 1}, {1, 0}};
  for (const Vec4& t : cornerTangents(p, std::vector<Vec3>(3, kUp), uv, std::vector<std::uint32_t>{0, 1, 2})) {
    expectNear(Vec3(t), {1, 0, 0});
    EXPECT_EQ(t.w, 1);
    expectNear(bitangent(t, kUp), {0, 1, 0});  // towards decreasing v
  }
}

TEST(Tangents, MirroredImageTurnsTheSign) {
  const std::vector<Vec3> p = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
  const std::vector<Vec2> uv = {{1, 1}, {0, 1}, {0, 0}};
  for (const Vec4& t : cornerTangents(p, std::vector<Vec3>(3, kUp), uv, std::vector<std::uint32_t>{0, 1, 2})) {
    expectNear(Vec3(t), {-1, 0, 0});
    EXPECT_EQ(t.w, -1);
    expectNear(bitangent(t, kUp), {0, 1, 0});
  }
}

/// Two squares side by side, the right one with the left one's image mirrored, sharing the middle vertices.
Primitive mirroredPair() {
  Primitive p;
  p.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {1, 0, 0}, {1, 1, 0}};
  p.normals.assign(6, kUp);
  p.uvSets = {{{0, 1}, {1, 1}, {1, 0}, {0, 0}, {0, 1}, {0, 0}}};
  p.indices = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
  return p;
}

TEST(Tangents, MirroredIslandsSplitTheirSharedVerticesAndNeverMix) {
  Primitive p = mirroredPair();
  makeTangents(p, 0, Mat3(1.0f));
  EXPECT_EQ(p.positions.size(), 8u);
  for (std::size_t c = 0; c < p.indices.size(); ++c) {
    const Vec4& t = p.tangents[p.indices[c]];
    const bool left = c < 6;
    expectNear(Vec3(t), {left ? 1.0f : -1.0f, 0, 0});
    EXPECT_EQ(t.w, left ? 1 : -1);
  }
}

TEST(Tangents, SmoothNeighboursAverageByAngleInThePlaneOfTheNormal) {
  // Two triangles fold about the y axis with a common normal there; their tangents tilt down to either side.
  const std::vector<Vec3> p = {{0, 0, 0}, {0, 1, 0}, {-1, 0, -1}, {1, 0, -1}};
  const std::vector<Vec3> n(4, kUp);
  const std::vector<Vec2> uv = {{0.5f, 1}, {0.5f, 0}, {0, 1}, {1, 1}};
  const auto t = cornerTangents(p, n, uv, std::vector<std::uint32_t>{0, 1, 2, 0, 3, 1});
  for (const Vec4& corner : t) expectNear(Vec3(corner), {1, 0, 0});
}

TEST(Tangents, OppositeWindingsAroundOneVertexStayApart) {
  // About the origin: a corner of 90 degrees whose u runs along x, and one of 45 that shows the image mirrored.
  const std::vector<Vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 1, 0}};
  const std::vector<Vec3> n(4, kUp);
  const std::vector<Vec2> uv = {{0, 0}, {1, 0}, {0, -1}, {1, -1}};
  const auto t = cornerTangents(p, n, uv, std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
  // Second triangle: steps (0,1) and (-1,1) for image steps (0,1) and (1,1) (v up): dP/du = (-1, 0, 0).
  expectNear(Vec3(t[0]), {1, 0, 0});
  EXPECT_EQ(t[0].w, 1);
  expectNear(Vec3(t[3]), {-1, 0, 0});
  EXPECT_EQ(t[3].w, -1);
}

TEST(Tangents, WeightsAreAnglesNotAreas) {
  // The fan about the origin has corners of 90 and 45 degrees with the same winding; u turns by 90 degrees between.
  const std::vector<Vec3> p = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {-1, 1, 0}};
  const std::vector<Vec3> n(4, kUp);
  // Image (v up): first triangle upright; the second's far corner continues so that dP/du stays counter-clockwise.
  const std::vector<Vec2> uv = {{0, 0}, {10, 0}, {0, -10}, {-5, -5}};
  const auto t = cornerTangents(p, n, uv, std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
  // Second triangle: image edges (0,10) and (-5,5) (v up) for steps (0,10) and (-1,1): dP/du = (0.2, 0.8)/..., that
  // is the direction d with (-1,1) = -5 d + 5 (0,1): d = (0.2, 0.8).
  const Vec2 first(1, 0), second = glm::normalize(Vec2(0.2f, 0.8f));
  const Vec2 mean = glm::normalize(kPi / 2 * first + kPi / 4 * second);
  expectNear(Vec3(t[0]), {mean.x, mean.y, 0}, 1e-5f);
  EXPECT_EQ(t[0], t[3]);
}

TEST(Tangents, DegenerateImagesBorrowFromNeighboursOrFallBack) {
  Primitive p = mirroredPair();
  p.indices.resize(9);                                     // left square and one triangle of the right
  for (std::size_t v : {4u, 5u}) p.uvSets[0][v] = {1, 1};  // whose image is a line
  makeTangents(p, 0, Mat3(1.0f));
  expectNear(Vec3(p.tangents[p.indices[6]]), {1, 0, 0});  // the shared corner joins the left
  for (const Vec4& t : p.tangents) {
    EXPECT_NEAR(glm::length(Vec3(t)), 1, 1e-6);
    EXPECT_NEAR(t.z, 0, 1e-6);
    EXPECT_EQ(std::abs(t.w), 1);
  }
  for (auto& uv : p.uvSets[0]) uv = {0.5f, 0.5f};
  p.tangents.clear();
  makeTangents(p, 0, Mat3(1.0f));
  for (const Vec4& t : p.tangents) EXPECT_NEAR(glm::length(Vec3(t)), 1, 1e-6);
}

TEST(Tangents, DoNotDependOnTheOrderOfTriangles) {
  Primitive a = mirroredPair(), b = mirroredPair();
  b.indices = {1, 5, 2, 0, 2, 3, 1, 4, 5, 0, 1, 2};
  const auto byPosition = [](Primitive& p) {
    makeTangents(p, 0, Mat3(1.0f));
    std::vector<std::array<float, 7>> rows;
    for (std::size_t v = 0; v < p.positions.size(); ++v)
      rows.push_back({p.positions[v].x, p.positions[v].y, p.positions[v].z, p.tangents[v].x, p.tangents[v].y,
                      p.tangents[v].z, p.tangents[v].w});
    std::sort(rows.begin(), rows.end());
    return rows;
  };
  EXPECT_EQ(byPosition(a), byPosition(b));
}

TEST(Tangents, TheMapsTransformTurnsTheFrame) {
  Primitive p = mirroredPair();
  p.indices.resize(6);
  // Quarter turn of the UVs: u' = -v, v' = u; u' grows where v decreases, upwards.
  makeTangents(p, 0, Mat3(Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(0, 0, 1)));
  expectNear(Vec3(p.tangents[p.indices[0]]), {0, 1, 0});
}

}  // namespace
}  // namespace lumel
