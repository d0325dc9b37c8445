// Shapes, and the number of charts that a person would cut them into.
#include <gtest/gtest.h>

#include <ostream>

#include <cmath>

#include "lightmap/atlas/atlas.h"
#include "lightmap/pack/pack_shape.h"
#include "tests/lightmap/chart_checks.h"
#include "tests/lightmap/test_shapes.h"

namespace lumel {
namespace {

struct ShapeCase {
  const char* name;
  Shape shape;
  float texelsPerMeter;
  std::size_t leastCharts, mostCharts;
  std::size_t degenerate = 0;
  std::size_t nonManifoldEdges = 0;
  double mostStretch = 1.25;  // but for the worst percent of the surface
};

/// For the names that test runners list.
void PrintTo(const ShapeCase& shape, std::ostream* out) { *out << shape.name; }

std::vector<ShapeCase> shapeCases() {
  std::vector<ShapeCase> cases;
  cases.push_back({"Cube", box(Vec3(0), Vec3(1)), 50, 6, 6});
  // Each of its narrow sides lies beside the top or the bottom: alone it would be all gutter.
  cases.push_back({"BoardOfOneTexel", box(Vec3(0), Vec3(3, 2, 0.05f)), 20, 2, 2});
  Shape triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  triangle.indices = {0, 1, 2};
  cases.push_back({"OneTriangle", triangle, 50, 1, 1});
  cases.push_back({"Cylinder", cylinder(32, 1, 3), 30, 3, 3});
  cases.push_back({"HalfPipeOfFlatFaces",
                   grid(12, 1, false, false,
                        [](double u, double v) {
                          return Vec3(std::cos(std::numbers::pi * u), std::sin(std::numbers::pi * u), 4 * v);
                        }),
                   30, 1, 1});
  // A person would cut bands around the tube; each chart may bend by its stretch limit.
  cases.push_back({"Torus", torus(64, 32), 20, 2, 8});
  cases.push_back({"Sphere", sphere(48, 24), 60, 2, 8, 2 * 48});
  // It has one edge of contrary winding. In one piece it would be an S that fills a seventh of its box.
  cases.push_back({"MoebiusStrip", moebiusStrip(), 20, 1, 3, 0, 1});
  // Opposite faces, wound the other way, lie nearly in one plane: fifty sheets go through the edge.
  cases.push_back({"FanOfAHundredFacesOnOneEdge", fanOnOneEdge(100), 30, 50, 52, 0, 1});
  Shape cubes = box(Vec3(0), Vec3(1));
  cubes.add(box(Vec3(1, 1, 0), Vec3(2, 2, 1)));
  cases.push_back({"TwoCubesJoinedAtAnEdge", cubes, 30, 12, 12, 0, 1});
  // A strip a millionth as wide as long, beside a square: both get their place at full density.
  Shape slivers;
  slivers.positions = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}, {10, 10.00001f, 0}, {0, 10.00001f, 0}};
  slivers.quad(0, 1, 2, 3);
  slivers.quad(3, 2, 4, 5);
  cases.push_back({"SliversOfAspectAMillion", slivers, 20, 1, 1});
  cases.push_back({"FlatWallWithTJunctionSlivers", wallWithTJunctions(), 30, 1, 1, 0, 0, 1.001});
  Shape zero = box(Vec3(0), Vec3(1));
  for (const std::uint32_t i : {0u, 0u, 1u, 2u, 3u, 3u}) zero.indices.push_back(i);
  cases.push_back({"CubeWithZeroAreaTriangles", zero, 30, 6, 6, 2});
  Shape twice = box(Vec3(0), Vec3(1));
  twice.add(box(Vec3(0), Vec3(1)));
  cases.push_back({"CubeOfDuplicateFaces", twice, 30, 12, 12, 0, 18});
  return cases;
}

/// What holds for every atlas of these shapes.
AtlasFigures expectSound(const AtlasResult& result, std::size_t triangles, std::size_t degenerate,
                         double mostStretch = 1.25) {
  const AtlasFigures f = measureAtlas(result.atlas);
  EXPECT_EQ(f.triangles + degenerate, triangles);
  EXPECT_EQ(result.report.degenerateTriangles, degenerate);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.outside, 0u);
  EXPECT_EQ(f.mirroredTangents, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  // Uniform density within 2 %, the issue's own limit; float UVs of the smallest charts cost some of it. Charts whose
  // borders were moved to whole texels may be smaller.
  EXPECT_GE(f.minDensity / result.atlas.texelsPerMeter, 0.98 * (1 - kMostSnap));
  EXPECT_LE(f.maxDensity / result.atlas.texelsPerMeter, 1.02);
  EXPECT_LE(f.worstStretch, mostStretch);
  return f;
}

class Shapes : public testing::TestWithParam<std::tuple<ShapeCase, float>> {};

TEST_P(Shapes, HaveTheChartsThatAPersonWouldChooseInAnyUnit) {
  const auto& [shapeCase, scale] = GetParam();
  Shape s = shapeCase.shape;
  for (Vec3& p : s.positions) p *= scale;
  const AtlasResult result = chartsOf(s.scene(), shapeCase.texelsPerMeter / scale);
  const AtlasFigures f = expectSound(result, s.indices.size() / 3, shapeCase.degenerate, shapeCase.mostStretch);
  EXPECT_EQ(result.report.nonManifoldEdges, shapeCase.nonManifoldEdges);
  EXPECT_GE(f.charts, shapeCase.leastCharts);
  EXPECT_LE(f.charts, shapeCase.mostCharts);
}

INSTANTIATE_TEST_SUITE_P(
    , Shapes, testing::Combine(testing::ValuesIn(shapeCases()), testing::Values(1.0f, 1e-4f, 1e6f)),
    [](const testing::TestParamInfo<Shapes::ParamType>& param) {
      const float scale = std::get<1>(param.param);
      return std::string(std::get<0>(param.param).name) + (scale < 1 ? "Tiny" : scale > 1 ? "Huge" : "");
    });

TEST(Charts, OfAFlatWallCoverItOnce) {
  const AtlasFigures f = measureAtlas(chartsOf(wallWithTJunctions().scene(), 30).atlas);
  EXPECT_NEAR(f.coveredTexels, 8 * 3 * 30 * 30, 8 * 3 * 30 * 30 * 0.001);
}

/// No part of it is like another. Of an even torus the alike bands cost the same to join, and which pair is first, and
/// with it whether there are 4 or 6 charts, hangs on how positions are rounded.
Shape lumpyTorus() {
  Shape s = grid(32, 16, true, true, [](double u, double v) {
    const double tube = 0.6 * (1 + 0.2 * std::sin(kTau * u + 0.3) + 0.1 * std::cos(kTau * (2 * u + v) + 1));
    const double r = 2 + tube * std::cos(kTau * v);
    return Vec3(r * std::cos(kTau * u), 1.2 * r * std::sin(kTau * u),
                tube * std::sin(kTau * v) + 0.2 * std::sin(kTau * u + 2));
  });
  smoothNormals(s);
  return s;
}

class Scales : public testing::TestWithParam<float> {};

TEST_P(Scales, ChangeNothingButTheUnit) {
  Shape s = cylinder(24, 1, 2);
  s.add(lumpyTorus());
  s.add(shadedFlat(box(Vec3(4, 0, 0), Vec3(4.01f, 3, 1))));
  const std::size_t charts = chartsOf(s.scene(), 20).atlas.charts.size();
  for (Vec3& p : s.positions) p *= GetParam();
  const AtlasResult scaled = chartsOf(s.scene(), 20 / GetParam());
  expectSound(scaled, s.indices.size() / 3, 0);
  EXPECT_EQ(scaled.atlas.charts.size(), charts);
}

INSTANTIATE_TEST_SUITE_P(, Scales,
                         testing::Values(1e-4f, 1e-3f, 0.01f, 0.1f, 3.0f, 10.0f, 100.0f, 1e6f, 0x1p-13f, 0x1p20f));

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
  const AtlasFigures f = measureAtlas(framed.atlas);
  EXPECT_EQ(f.triangles, 4u);
  EXPECT_EQ(f.flipped, 0u);
  EXPECT_EQ(f.overlapTexels, 0.0);
  EXPECT_NEAR(f.minDensity, 50, 1);
  EXPECT_NEAR(f.maxDensity, 50, 1);
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

}  // namespace
}  // namespace lumel
