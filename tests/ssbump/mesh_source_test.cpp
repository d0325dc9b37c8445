#include "ssbump/mesh/mesh_source.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "lightmap/maps/rnm_basis.h"
#include "ssbump/mesh/low_poly.h"
#include "ssbump/occlusion/horizon.h"
#include "tests/mentions.h"
#include "tests/ssbump/closed_forms.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

using namespace closed_forms;

Progress silent;

/// Quads of four corners each, counter-clockwise from the front; UVs optional (four per quad).
Scene quads(const std::vector<Vec3>& corners, const std::vector<Vec2>& uvs = {}, const Mat4& world = Mat4(1)) {
  Primitive primitive;
  primitive.name = "quads";
  primitive.positions = corners;
  for (std::size_t q = 0; q * 4 < corners.size(); ++q) {
    const Vec3 n = glm::normalize(glm::cross(corners[q * 4 + 1] - corners[q * 4], corners[q * 4 + 2] - corners[q * 4]));
    for (int k = 0; k < 4; ++k) primitive.normals.push_back(n);
    const auto base = static_cast<std::uint32_t>(q * 4);
    for (std::uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) primitive.indices.push_back(base + i);
  }
  if (!uvs.empty()) primitive.uvSets.push_back(uvs);
  Scene scene;
  scene.materials.resize(1);
  scene.meshes.push_back({"mesh", {primitive}});
  scene.instances.push_back({"node", 0, world, {}});
  return scene;
}

/// The plane y = 0 from -size to size.
std::vector<Vec3> ground(float size) {
  return {{-size, 0, size}, {size, 0, size}, {size, 0, -size}, {-size, 0, -size}};
}

/// What the texel at the middle of a small flat tile about the origin sees.
std::vector<float> atOrigin(const Scene& high, int rays = 16384) {
  MeshSettings s;
  s.width = s.height = 1;
  s.tileWidth = s.tileHeight = 0.01f;
  s.wrap = false;
  s.rays.count = rays;
  std::vector<Lobe> lobes = rnmLobes();
  lobes.push_back(ambientLobe());
  auto texels = gatherMesh(high, nullptr, s, lobes, silent);
  EXPECT_TRUE(texels) << (texels ? "" : texels.error().message);
  return texels ? texels->occlusion.pixels : std::vector<float>(4);
}

// 16384 stratified rays: measured error 3e-4; the rest is for walls that end after 1000 units.
constexpr double kTolerance = 0.002;

TEST(MeshSource, FlatGroundIsOpen) {
  for (float v : atOrigin(quads(ground(10)), 64)) EXPECT_EQ(v, 1.0f);
}

TEST(MeshSource, AWallInTheFlatTilesFrame) {
  // East is +x, north of the picture is -z.
  std::vector<Vec3> east = ground(10), north = ground(10);
  for (Vec3 p : {Vec3(2, 0, 1000), Vec3(2, 3, 1000), Vec3(2, 3, -1000), Vec3(2, 0, -1000)}) east.push_back(p);
  for (Vec3 p : {Vec3(-1000, 0, -2), Vec3(-1000, 3, -2), Vec3(1000, 3, -2), Vec3(1000, 0, -2)}) north.push_back(p);
  const auto e = atOrigin(quads(east)), n = atOrigin(quads(north));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(e[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kEast, 1.5)}), kTolerance);
    EXPECT_NEAR(n[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kNorth, 1.5)}), kTolerance);
  }
}

TEST(MeshSource, LightComesInUnderAnOverhang) {
  // A sheet 1 above the ground, from 0.5 to 4 east of the texel: hides the elevations between atan(1/4) and
  // atan(1/0.5).
  std::vector<Vec3> corners = ground(10);
  for (Vec3 p : {Vec3(0.5f, 1, 1000), Vec3(4, 1, 1000), Vec3(4, 1, -1000), Vec3(0.5f, 1, -1000)}) corners.push_back(p);
  const double hidden = (std::cos(std::atan(1 / 4.0)) - std::cos(std::atan(1 / 0.5))) / 2;
  EXPECT_NEAR(atOrigin(quads(corners))[3], 1 - hidden, kTolerance);
}

TEST(MeshSource, ATileRepeats) {
  // A thin wall along the tile's right edge is also just left of its left edge.
  std::vector<Vec3> corners{{0, 0, 4}, {4, 0, 4}, {4, 0, 0}, {0, 0, 0}};
  for (Vec3 p : {Vec3(3.99f, 0, 4), Vec3(3.99f, 2, 4), Vec3(3.99f, 2, 0), Vec3(3.99f, 0, 0)}) corners.push_back(p);
  MeshSettings s;
  s.width = s.height = 8;
  s.rays.count = 1024;
  const auto lobes = rnmLobes();
  for (bool wrap : {true, false}) {
    s.wrap = wrap;
    auto texels = gatherMesh(quads(corners), nullptr, s, lobes, silent);
    ASSERT_TRUE(texels);
    const float west = texels->occlusion.at(0, 4)[1];  // B1 leans to the upper left
    if (wrap)
      EXPECT_LT(west, 0.6f);
    else
      EXPECT_GT(west, 0.95f);
  }
}

TEST(MeshSource, AgreesWithTheHeightFieldItIsMadeOf) {
  const HeightField field = fields::fractal(32, 32, 6, 3);
  std::vector<Vec3> corners;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      for (const auto& [dx, dy] : {std::pair{0, 1}, {1, 1}, {1, 0}, {0, 0}})
        corners.push_back(
            {static_cast<float>(x + dx) - 15.5f, field.at(x + dx, y + dy), static_cast<float>(y + dy) - 15.5f});
  MeshSettings s;
  s.width = s.height = 32;
  s.tileWidth = s.tileHeight = 32;  // about the origin: texel centres are the vertices
  s.rays.count = 1024;
  const auto lobes = rnmLobes();
  auto mesh = gatherMesh(quads(corners), nullptr, s, lobes, silent);
  ASSERT_TRUE(mesh);
  const Image horizon = Horizon(field, {}).occlusion({0, 0, 32, 32}, lobes);
  double squares = 0;
  for (std::size_t i = 0; i < horizon.pixels.size(); ++i)
    squares += std::pow(static_cast<double>(horizon.pixels[i] - mesh->occlusion.pixels[i]), 2);
  // 0.004 of noise in 1024 rays, and cells split along the other diagonal.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(horizon.pixels.size())), 0.012);
}

const std::vector<Vec3> kLowCorners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<Vec2> kUvs{{0, 1}, {1, 1}, {1, 0}, {0, 0}};  // u along x, v down

/// A plate in the plane z = 0 with a fence standing on it at x = 0.625, and what the texel at x = 0.5625 sees of it.
std::vector<float> atFence(const std::vector<Vec2>& uvs, int column, const Mat4& world) {
  std::vector<Vec3> fence{{-3, -3, 0}, {4, -3, 0}, {4, 4, 0}, {-3, 4, 0}};
  for (Vec3 p : {Vec3(0.625f, -100, 0), Vec3(0.625f, -100, 0.125f), Vec3(0.625f, 100, 0.125f), Vec3(0.625f, 100, 0)})
    fence.push_back(p);
  const Scene high = quads(fence, {}, world), low = quads(kLowCorners, uvs, world);
  MeshSettings s;
  s.width = s.height = 8;
  s.cage = 0.05f;
  s.rays.count = 4096;
  auto texels = gatherMesh(high, &low, s, rnmLobes(), silent);
  EXPECT_TRUE(texels) << (texels ? "" : texels.error().message);
  for (float c : texels->coverage.pixels) EXPECT_EQ(c, 1.0f);
  const float* o = texels->occlusion.at(column, 3);
  return {o[0], o[1], o[2]};
}

TEST(MeshSource, LowPolyFramesFollowUvsAndTransforms) {
  const Mat4 turned = glm::rotate(glm::translate(Mat4(1), Vec3(3, -2, 8)), 1.1f, glm::normalize(Vec3(1, 2, -1)));
  const Mat4 mirrored = glm::scale(turned, Vec3(-1, 1, 1));
  std::vector<Vec2> flippedU = kUvs;
  for (Vec2& uv : flippedU) uv.x = 1 - uv.x;
  // 4096 stratified rays: 0.001.
  for (const Mat4& world : {Mat4(1), turned, mirrored}) {
    const auto plain = atFence(kUvs, 4, world), flipped = atFence(flippedU, 3, world);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(plain[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kEast, 2)}), 0.005);
      EXPECT_NEAR(flipped[i], visibilityAbovePlanes(kRnmBasis[i], {wallPlane(kWest, 2)}), 0.005);
    }
  }
}

TEST(MeshSource, HighPolyNormalsAreInTheLowPolysFrame) {
  // A high-poly plane that leans up towards +x by 20 degrees, over a level low-poly one.
  const float s = std::tan(20 * kPi / 180);
  std::vector<Vec3> leaning;
  for (Vec3 p : {Vec3(-1, -1, 0), Vec3(2, -1, 0), Vec3(2, 2, 0), Vec3(-1, 2, 0)})
    leaning.push_back({p.x, p.y, 0.1f * s * (p.x - 0.5f)});
  const Scene low = quads(kLowCorners, kUvs);
  MeshSettings settings;
  settings.width = settings.height = 4;
  settings.cage = 1;
  settings.rays.count = 16;
  auto texels = gatherMesh(quads(leaning), &low, settings, rnmLobes(), silent);
  ASSERT_TRUE(texels);
  const Vec3 expected = glm::normalize(Vec3(-0.1f * s, 0, 1));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(texels->normals.at(1, 2)[i], expected[i], 1e-5);
}

TEST(MeshSource, BadMeshesAreErrors) {
  const auto lobes = rnmLobes();
  MeshSettings s;
  s.width = s.height = 4;
  Scene empty;
  EXPECT_EQ(gatherMesh(empty, nullptr, s, lobes, silent).error().kind, ErrorKind::Input);
  const Scene noUvs = quads(kLowCorners), high = quads(ground(1));
  EXPECT_TRUE(mentions(gatherMesh(high, &noUvs, s, lobes, silent).error().message, "UV set"));
  Scene nan = quads(ground(1));
  nan.meshes[0].primitives[0].positions[2].y = NAN;
  EXPECT_EQ(gatherMesh(nan, nullptr, s, lobes, silent).error().kind, ErrorKind::Input);
  // Degenerate triangles and UVs without area leave texels uncovered, not a crash.
  const Scene collapsed = quads(kLowCorners, {{0, 0}, {0, 0}, {0, 0}, {0, 0}});
  auto texels = gatherMesh(high, &collapsed, s, lobes, silent);
  ASSERT_TRUE(texels);
  for (float c : texels->coverage.pixels) EXPECT_EQ(c, 0.0f);
}

TEST(MeshSource, DilationFillsBesideTheCharts) {
  std::vector<Vec2> small = kUvs;
  for (Vec2& uv : small) uv = uv * 0.5f;
  const Scene low = quads(kLowCorners, small), high = quads({{-1, -1, 0}, {2, -1, 0}, {2, 2, 0}, {-1, 2, 0}});
  MeshSettings s;
  s.width = s.height = 16;
  s.dilate = 2;
  s.rays.count = 16;
  auto texels = gatherMesh(high, &low, s, rnmLobes(), silent);
  ASSERT_TRUE(texels);
  EXPECT_EQ(*texels->coverage.at(7, 4), 1.0f);
  EXPECT_EQ(*texels->coverage.at(9, 4), 0.5f);
  EXPECT_EQ(*texels->coverage.at(10, 4), 0.0f);
}

}  // namespace
}  // namespace lumel::ssbump
