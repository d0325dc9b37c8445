#include "lightmap/atlas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "lightmap/pack_shape.h"
#include "scene/parallel.h"
#include "tests/lightmap/chart_checks.h"

namespace lumel {
namespace {

struct Shape {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> normals;

  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    for (const std::uint32_t i : {a, b, c, a, c, d}) indices.push_back(i);
  }
  void add(const Shape& other) {
    ASSERT_EQ(normals.empty(), other.normals.empty()) << "one has normals, the other has not";
    const auto base = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), other.positions.begin(), other.positions.end());
    normals.insert(normals.end(), other.normals.begin(), other.normals.end());
    for (const std::uint32_t i : other.indices) indices.push_back(base + i);
  }
  Scene scene() const { return sceneOf(positions, indices, normals); }
};

Shape box(Vec3 low, Vec3 high) {
  Shape s;
  for (int i = 0; i < 8; ++i) s.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  s.quad(0, 4, 6, 2);
  s.quad(1, 3, 7, 5);
  s.quad(0, 1, 5, 4);
  s.quad(2, 6, 7, 3);
  s.quad(0, 2, 3, 1);
  s.quad(4, 5, 7, 6);
  return s;
}

/// A grid of (columns + 1) x (rows + 1) points; `wrap` joins the last column (row) to the first.
template <class Point>
Shape grid(int columns, int rows, bool wrapColumns, bool wrapRows, Point point) {
  Shape s;
  const int width = wrapColumns ? columns : columns + 1;
  const int height = wrapRows ? rows : rows + 1;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) s.positions.push_back(point(static_cast<double>(x) / columns, static_cast<double>(y) / rows));
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>((y % height) * width + x % width); };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) s.quad(at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
  return s;
}

void smoothNormals(Shape& s) {
  std::vector<Vec3d> sums(s.positions.size(), Vec3d(0.0));
  for (std::size_t i = 0; i < s.indices.size(); i += 3) {
    const Vec3d a(s.positions[s.indices[i]]), b(s.positions[s.indices[i + 1]]), c(s.positions[s.indices[i + 2]]);
    for (std::size_t k = 0; k < 3; ++k) sums[s.indices[i + k]] += glm::cross(b - a, c - a);
  }
  s.normals.clear();
  for (const Vec3d& sum : sums) s.normals.push_back(Vec3(glm::normalize(sum)));
}

/// The same with points of their own for each triangle, shaded flat.
Shape shadedFlat(const Shape& s) {
  const Scene scene = sceneOf(s.positions, s.indices);
  const Primitive& p = scene.meshes[0].primitives[0];
  Shape flat;
  flat.positions = p.positions;
  flat.normals = p.normals;
  flat.indices = p.indices;
  return flat;
}

constexpr double kTau = 2 * std::numbers::pi;

Shape cylinder(int sides, double radius, double height) {
  Shape s = grid(sides, 4, true, false, [&](double u, double v) {
    return Vec3(radius * std::cos(kTau * u), radius * std::sin(kTau * u), height * v);
  });
  smoothNormals(s);
  for (const int end : {0, 1}) {  // caps, shaded flat: points of their own
    const auto base = static_cast<std::uint32_t>(s.positions.size());
    for (int i = 0; i < sides; ++i) {
      s.positions.push_back(s.positions[static_cast<std::size_t>(end * 4 * sides + i)]);
      s.normals.push_back(Vec3(0, 0, end ? 1 : -1));
    }
    for (std::uint32_t i = 2; i < static_cast<std::uint32_t>(sides); ++i)
      for (const std::uint32_t k : {0u, end ? i - 1 : i, end ? i : i - 1}) s.indices.push_back(base + k);
  }
  return s;
}

Shape torus(int columns, int rows) {
  Shape s = grid(columns, rows, true, true, [](double u, double v) {
    const double r = 2 + 0.6 * std::cos(kTau * v);
    return Vec3(r * std::cos(kTau * u), r * std::sin(kTau * u), 0.6 * std::sin(kTau * v));
  });
  smoothNormals(s);
  return s;
}

Shape sphere(int columns, int rows) {
  Shape s = grid(columns, rows, true, false, [](double u, double v) {
    const double polar = std::numbers::pi * v;
    // Exact poles, so that they are one point each.
    const double ring = v == 0 || v == 1 ? 0.0 : std::sin(polar);
    return Vec3(ring * std::cos(kTau * u), ring * std::sin(kTau * u), -std::cos(polar));
  });
  s.normals = s.positions;
  return s;
}

/// What holds for every atlas. `smallest`: charts below so many texels are not asked for density.
AtlasFigures expectSound(const Shape& shape, const AtlasResult& result, std::size_t degenerate = 0) {
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles + degenerate, shape.indices.size() / 3);
  EXPECT_EQ(result.report.degenerateTriangles, degenerate);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.outside, 0u);
  EXPECT_EQ(f.mirroredTangents, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  // Uniform density within 2 %, the issue's own limit; float UVs of the smallest charts cost some of it. Charts whose
  // borders were moved to whole texels may be smaller.
  EXPECT_GE(f.minDensity / result.atlas.texelsPerMeter, 0.98 * (1 - kMostSnap));
  EXPECT_LE(f.maxDensity / result.atlas.texelsPerMeter, 1.02);
  EXPECT_LE(f.worstStretch, 1.25);
  return f;
}

AtlasFigures expectSound(const Shape& shape, float texelsPerMeter, std::size_t degenerate = 0) {
  return expectSound(shape, chartsOf(shape.scene(), texelsPerMeter), degenerate);
}

TEST(Charts, CubeHasAtMostSix) {
  EXPECT_LE(expectSound(box(Vec3(0), Vec3(1)), 50).charts, 6u);
}

TEST(Charts, BoardOfOneTexelHasTwo) {
  // Each of its narrow sides lies beside the top or the bottom: alone it would be all gutter.
  EXPECT_EQ(expectSound(box(Vec3(0), Vec3(3, 2, 0.05f)), 20).charts, 2u);
}

TEST(Charts, OneTriangle) {
  Shape s;
  s.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  s.indices = {0, 1, 2};
  EXPECT_EQ(expectSound(s, 50).charts, 1u);
}

TEST(Charts, CylinderUnrollsIntoThree) {
  EXPECT_EQ(expectSound(cylinder(32, 1, 3), 30).charts, 3u);
}

TEST(Charts, HalfPipeOfFlatFacesUnrollsIntoOne) {
  const Shape s = grid(12, 1, false, false, [](double u, double v) {
    return Vec3(std::cos(std::numbers::pi * u), std::sin(std::numbers::pi * u), 4 * v);
  });
  EXPECT_EQ(expectSound(s, 30).charts, 1u);
}

TEST(Charts, TorusTakesAFew) {
  // Each chart may bend by its stretch limit: a person would cut bands around the tube.
  EXPECT_LE(expectSound(torus(64, 32), 20).charts, 12u);
}

TEST(Charts, SphereTakesAFew) {
  const Shape s = sphere(48, 24);
  EXPECT_LE(expectSound(s, 60, 2 * 48).charts, 8u);
}

TEST(Charts, MoebiusStripIsOneOrTwoAlthoughItHasOneSide) {
  Shape s;
  constexpr int kSteps = 96;
  for (int i = 0; i < kSteps; ++i)
    for (const double w : {-0.4, 0.4}) {
      const double a = kTau * i / kSteps;
      const double r = 3 + w * std::cos(a / 2);
      s.positions.push_back(Vec3(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2)));
    }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const std::uint32_t next = (i + 1) % kSteps;
    const bool twist = next == 0;
    s.quad(2 * i, 2 * next + (twist ? 1 : 0), 2 * next + (twist ? 0 : 1), 2 * i + 1);
  }
  const AtlasFigures f = expectSound(s, 20);
  EXPECT_LE(f.charts, 4u);
}

TEST(Charts, FanOfAHundredFacesOnOneEdge) {
  Shape s;
  s.positions = {{0, 0, 0}, {0, 0, 1}};
  for (std::uint32_t i = 0; i < 100; ++i) {
    const double a = kTau * i / 100;
    s.positions.push_back(Vec3(std::cos(a), std::sin(a), 0.5));
    for (const std::uint32_t k : {i % 2 ? 0u : 1u, i % 2 ? 1u : 0u, i + 2}) s.indices.push_back(k);
  }
  const AtlasResult result = chartsOf(s.scene(), 30);
  EXPECT_EQ(result.report.nonManifoldEdges, 1u);
  EXPECT_LE(expectSound(s, result).charts, 100u);
}

TEST(Charts, TwoCubesJoinedAtAnEdge) {
  Shape s = box(Vec3(0), Vec3(1));
  s.add(box(Vec3(1, 1, 0), Vec3(2, 2, 1)));
  const AtlasResult result = chartsOf(s.scene(), 30);
  EXPECT_EQ(result.report.nonManifoldEdges, 1u);
  EXPECT_LE(expectSound(s, result).charts, 12u);
}

TEST(Charts, SliversOfAspectAMillion) {
  // A strip a millionth as wide as long, beside a square: both get their place at full density.
  Shape s;
  s.positions = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}, {10, 10.00001f, 0}, {0, 10.00001f, 0}};
  s.quad(0, 1, 2, 3);
  s.quad(3, 2, 4, 5);
  EXPECT_EQ(expectSound(s, 20).charts, 1u);
}

TEST(Charts, FlatWallWithTJunctionSliversIsOneChart) {
  // The wall's upper edge has many points, its lower part one long edge: slivers of rounding size between them.
  Shape s;
  constexpr std::uint32_t kPoints = 9;
  for (std::uint32_t i = 0; i < kPoints; ++i)
    s.positions.push_back({static_cast<float>(i), i % 2 ? 1.0000001f : 1.0f, i == 4 ? 3e-7f : 0.0f});
  for (std::uint32_t i = 0; i < kPoints; ++i) s.positions.push_back({static_cast<float>(i), 3, 0});
  s.positions.push_back({0, 0, 0});
  s.positions.push_back({8, 0, 0});
  for (std::uint32_t i = 0; i + 1 < kPoints; ++i) s.quad(i, i + 1, kPoints + i + 1, kPoints + i);
  const std::uint32_t a = 2 * kPoints, b = a + 1;
  s.quad(a, b, 8, 0);
  for (std::uint32_t i = 1; i + 1 < kPoints; ++i)
    for (const std::uint32_t k : {0u, i + 1, i}) s.indices.push_back(k);
  const AtlasResult result = chartsOf(s.scene(), 30);
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles + result.report.degenerateTriangles, s.indices.size() / 3);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_NEAR(f.coveredTexels, 8 * 3 * 30 * 30, 8 * 3 * 30 * 30 * 0.001);
  EXPECT_LE(f.worstStretch, 1.001);
  EXPECT_LE(f.charts, 2u);
}

TEST(Charts, ZeroAreaTrianglesAreCountedAndGetNoTexels) {
  Shape s = box(Vec3(0), Vec3(1));
  for (const std::uint32_t i : {0u, 0u, 1u, 2u, 3u, 3u}) s.indices.push_back(i);
  EXPECT_EQ(expectSound(s, 30, 2).charts, 6u);
}

TEST(Charts, DuplicateFacesEachGetTheirPlace) {
  Shape s = box(Vec3(0), Vec3(1));
  s.add(box(Vec3(0), Vec3(1)));
  EXPECT_EQ(expectSound(s, 30).charts, 12u);
}

class Scales : public testing::TestWithParam<float> {};

TEST_P(Scales, ChangeNothingButTheUnit) {
  Shape s = cylinder(24, 1, 2);
  s.add(torus(32, 16));
  s.add(shadedFlat(box(Vec3(4, 0, 0), Vec3(4.01f, 3, 1))));
  const std::size_t charts = expectSound(s, 20).charts;
  for (Vec3& p : s.positions) p *= GetParam();
  const std::size_t scaled = expectSound(s, 20 / GetParam()).charts;
  // A power of two leaves every bit of the geometry as it is. Others round positions anew, and where a torus's alike
  // bands are parted hangs on their last bits.
  const bool exact = std::exp2(std::round(std::log2(GetParam()))) == GetParam();
  EXPECT_NEAR(static_cast<double>(scaled), static_cast<double>(charts), exact ? 0 : 1);
}

INSTANTIATE_TEST_SUITE_P(, Scales, testing::Values(1e-4f, 1e6f, 0x1p-13f, 0x1p20f));

TEST(Charts, BreakAtMirroredMaterialFramesOnly) {
  // Two coplanar squares, the right one with its texture mirrored.
  const auto make = [](bool withFrames) {
    Scene scene = sceneOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}},
                          {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7}, std::vector<Vec3>(8, Vec3(0, 0, 1)));
    Primitive& p = scene.meshes[0].primitives[0];
    p.uvSets = {{{0, 1}, {1, 1}, {1, 0}, {0, 0}, {1, 1}, {0, 1}, {0, 0}, {1, 0}}};
    if (withFrames)
      for (int i = 0; i < 8; ++i) p.tangents.push_back(i < 4 ? Vec4(1, 0, 0, 1) : Vec4(-1, 0, 0, -1));
    return scene;
  };
  EXPECT_EQ(chartsOf(make(false), 50).atlas.charts.size(), 1u);
  const AtlasResult framed = chartsOf(make(true), 50);
  EXPECT_EQ(framed.atlas.charts.size(), 2u);
  for (const Surface& s : framed.atlas.surfaces)
    for (std::size_t i = 0; i < s.tangents.size(); ++i)
      EXPECT_EQ(s.tangents[i], s.sourceVertex[i] < 4 ? Vec4(1, 0, 0, 1) : Vec4(-1, 0, 0, -1));
}

TEST(Charts, DoNotCloseAroundABreakOfTheFrame) {
  // A flat ring of eight quads whose tangents turn with it: one break, where the turn ends, closes without a gap.
  Scene scene;
  scene.materials.emplace_back();
  Primitive p;
  constexpr int kSteps = 64;
  for (int i = 0; i <= kSteps; ++i) {
    const double a = kTau * i / kSteps;
    for (const double r : {1.0, 2.0}) {
      p.positions.push_back(i == kSteps ? p.positions[r > 1.5 ? 1 : 0] : Vec3(r * std::cos(a), r * std::sin(a), 0));
      p.normals.push_back(Vec3(0, 0, 1));
      p.tangents.push_back(Vec4(std::cos(a / 4), std::sin(a / 4), 0, 1));
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i)
    for (const std::uint32_t k : {2 * i, 2 * i + 1, 2 * i + 3, 2 * i, 2 * i + 3, 2 * i + 2}) p.indices.push_back(k);
  scene.meshes.push_back({"ring", {p}});
  scene.instances.emplace_back();
  scene.instances[0].name = "ring";
  const AtlasResult result = chartsOf(scene, 40);
  EXPECT_EQ(result.atlas.charts.size(), 2u);
  EXPECT_EQ(measureAtlas(result.atlas).overlapTexels, 0.0);
}

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

RememberedLayout layoutOf(const Atlas& atlas, const AtlasOptions& options) {
  RememberedLayout layout{atlas.chartDensity,  atlas.chartScale,   options.pageSize, options.padding,
                          options.blockAlign, options.maxStretch, {}};
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
    for (const Surface& s : first->atlas.surfaces) uvs[scene.instances[static_cast<std::size_t>(s.instance)].name] = s.lightmapUvs;
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
  EXPECT_NE(second->report.warnings[0].find("no room"), std::string::npos);
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
  EXPECT_NE(warningWith({.texelsPerMeter = 9, .pageSize = 128, .padding = 3}).find("padding"), std::string::npos);
  EXPECT_NE(warningWith({.texelsPerMeter = 9, .pageSize = 256}).find("page size"), std::string::npos);
  EXPECT_NE(warningWith({.texelsPerMeter = 8, .pageSize = 128}).find("density"), std::string::npos);
  EXPECT_NE(warningWith({.texelsPerMeter = 9, .pageSize = 128, .blockAlign = 4}).find("block"), std::string::npos);
  EXPECT_NE(warningWith({.texelsPerMeter = 9, .pageSize = 128, .maxStretch = 1.1f}).find("stretch"), std::string::npos);
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
  options.texelsPerMeter = 20;
  options.pageSize = 256;
  Progress progress;
  const Expected<AtlasResult> result = buildAtlas(s.scene(), options, progress);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Usage);
}

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
  const Scene scene = litScene({litSquare(0, {0, 0}, {0.5f, 0.5f}), litSquare(2, {0.5f, 0}, {1, 0.5f}), litSquare(4, {0, 0}, {1, 1})});
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

TEST(SceneUvs, MirroredChartsGetALeftHandedFrame) {
  Primitive p = litSquare(0, {0, 0}, {1, 1});
  for (Vec2& uv : p.uvSets[1]) uv.x = 1 - uv.x;
  const Expected<AtlasResult> result = withSceneUvs(litScene({p}), UvSource::Auto);
  ASSERT_TRUE(result);
  for (const Vec4& t : result->atlas.surfaces.at(0).tangents) EXPECT_EQ(t, Vec4(-1, 0, 0, -1));
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
