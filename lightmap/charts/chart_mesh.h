// One chart as a mesh of its own, and what a flattening does to it. Lengths are in texels.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/charts/half_edge_mesh.h"

namespace lumel {

/// A connected piece of a HalfEdgeMesh. Points of the mesh where the piece merely touches itself are several vertices.
struct ChartMesh : TriangleConnectivity {
  TexelPoints points;                        // per vertex
  std::vector<std::uint32_t> meshTriangles;  // per triangle: of the HalfEdgeMesh, ascending

  ChartMesh() = default;
  /// `opposite`: as for TriangleConnectivity.
  ChartMesh(const HalfEdgeMesh& mesh, std::vector<std::uint32_t> meshTriangles, std::span<const std::int32_t> opposite);
};

/// `triangles`: ascending, of `mesh`; connected over its neighbours.
ChartMesh makeChartMesh(const HalfEdgeMesh& mesh, std::vector<std::uint32_t> triangles);

/// Breadth-first over joined edges from a triangle. A chart is connected: every triangle is reached.
struct TriangleSteps {
  std::vector<std::uint32_t> distance;  // per triangle
  std::uint32_t farthest = 0;           // the last one reached
};
TriangleSteps stepsFrom(const ChartMesh& chart, std::uint32_t seed);

/// A triangle laid into the plane without distortion: corner 0 at the origin, corner 1 on the x axis, corner 2 above.
struct FlatTriangle {
  double x1 = 0, x2 = 0, y2 = 0;
};
inline FlatTriangle layFlat(const std::array<Vec3d, 3>& corners) {
  const Vec3d a = corners[1] - corners[0];
  const Vec3d b = corners[2] - corners[0];
  const double length = glm::length(a);
  return {length, glm::dot(a, b) / length, glm::length(glm::cross(a, b)) / length};
}
inline FlatTriangle layFlat(const ChartMesh& chart, std::size_t triangle) {
  const std::array<std::uint32_t, 3> v = chart.corners(triangle);
  return layFlat({chart.points[v[0]], chart.points[v[1]], chart.points[v[2]]});
}
double shortestHeight(const FlatTriangle& triangle);

/// Triangles thinner than this (texels) may stand askew or collapse: nothing of them shows.
inline constexpr double kNegligibleTexels = 0.01;

/// Those of the linear map from the surface's triangle to the texture's; `small` is not positive where that is turned
/// over.
struct SingularValues {
  double big = 0, small = 0;

  /// Whether no length is changed by more than a factor of `limit`, and nothing is turned over.
  bool within(double limit) const { return big <= limit && small * limit >= 1; }
};
/// Whether a triangle lies turned over by more than a float UV could lose.
bool isFlipped(const std::array<Vec2d, 3>& uv);
SingularValues singularValues(const FlatTriangle& surface, const std::array<Vec2d, 3>& uv);

/// Sander, Snyder, Gortler and Hoppe 2001, "Texture Mapping Progressive Meshes": singular values of the map from the
/// texture to the surface, with a chart scaled to its surface's area.
struct Stretch {
  double l2 = 0.0;          // root mean square over the surface; 1 is isometric
  double badShare = 0.0;    // share of the surface where a singular value or its inverse exceeds the limit
  std::size_t flipped = 0;  // triangles turned over by more than a float UV could lose, or without area though not thin
};
double surfaceArea(const ChartMesh& chart);
Stretch measureStretch(const ChartMesh& chart, std::span<const Vec2d> uvs, double limit);

/// Charts of less area (texels) should find a neighbour if any way can be found: they are mostly gutter.
inline constexpr double kTinyTexels = 4.0;

/// How much more bend and stretch a chart of this area (texels) may have than a large one, 1 .. 10: distortion that no
/// texel can resolve matters less than a chart of its own with a gutter around it.
inline double smallChartSlack(double area) {
  constexpr double kFullSize = 16.0;
  constexpr double kMost = 10.0;
  return area >= kFullSize ? 1.0 : std::min(kMost, kFullSize / std::max(area, 1e-300));
}

/// Twice the signed area; positive where counter-clockwise with y up.
inline double cross2(Vec2d a, Vec2d b) { return a.x * b.y - a.y * b.x; }

/// Scales to the surface's area (uniform density).
void scaleToSurface(const ChartMesh& chart, std::vector<Vec2d>& uvs);

/// Turns the chart so that its dominant border direction, else its smallest rectangle, is along the axes.
void alignToAxes(const ChartMesh& chart, std::vector<Vec2d>& uvs);

/// Whether a chart of this box and area (texels) is no longer than a page and, if it takes a good part of one, no thin
/// ring or long bow whose box is mostly empty.
bool packsWell(Vec2d size, double area, double largestSide);
bool packsWell(std::span<const Vec2d> uvs, double area, double largestSide);

/// Whether parts of the chart lie on each other by more than kOverlapTexels.
bool overlapsItself(const ChartMesh& chart, std::span<const Vec2d> uvs);

}  // namespace lumel
