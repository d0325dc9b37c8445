// Segmentation: triangles merge into ever larger nearly developable regions, cheapest merge first.
// Cost after Julius, Kraevoy and Sheffer 2005, "D-Charts: Quasi-Developable Mesh Segmentation" (variance of the normals
// about a cone's axis), with the merge tree of Garland, Willmott and Heckbert 2001, "Hierarchical Face Clustering".
#pragma once

#include <cstdint>
#include <vector>

#include "lightmap/charts/half_edge_mesh.h"

namespace lumel {

/// Weight of a crease that is shaded smooth, against 1 of a hard one.
inline constexpr double kSmoothCrease = 0.25;

/// Sums over a region's triangles by which its bend is judged.
struct NormalMoments {
  double area = 0.0;               // texels
  Vec3d sum{0.0};                  // of normals, weighted by area
  std::array<double, 6> moment{};  // xx yy zz xy xz yz of normals, weighted by area

  NormalMoments() = default;
  explicit NormalMoments(const Vec3d& areaNormal);  // of one triangle, twice its area long
  NormalMoments(const NormalMoments& a, const NormalMoments& b);

  /// Variance of the unit normals along the direction in which they vary least: 0 on planes, cylinders and cones.
  double coneVariance() const;
};

struct GrowOptions {
  double largestSide = 1000.0;    // texels: no region's bounding box is longer
  double maxConeVariance = 0.02;  // of the normals about the best cone; a spherical cap of 60 degrees has 0.021
  double maxCreaseCosine = 0.5;   // regions that meet at a sharper angle (mean over their border) stay apart
};

/// A binary tree of merges over the mesh's triangles: nodes 0 .. n-1 are triangles, node n + i is merge i.
struct MergeTree {
  std::size_t triangleCount = 0;
  std::vector<std::array<std::uint32_t, 2>> merges;
  std::vector<std::uint32_t> roots;  // the regions, in the order of their smallest triangle

  bool isLeaf(std::uint32_t node) const { return node < triangleCount; }
  const std::array<std::uint32_t, 2>& children(std::uint32_t node) const { return merges[node - triangleCount]; }
  /// Triangles below a node, ascending.
  std::vector<std::uint32_t> trianglesBelow(std::uint32_t node) const;
};

MergeTree growCharts(const HalfEdgeMesh& mesh, const GrowOptions& options);

/// The triangle's normal, not normalised: twice its area long.
inline Vec3d areaNormal(const HalfEdgeMesh& mesh, std::uint32_t triangle) {
  const std::array<std::uint32_t, 3> v = mesh.corners(triangle);
  return glm::cross(mesh.points[v[1]] - mesh.points[v[0]], mesh.points[v[2]] - mesh.points[v[0]]);
}

}  // namespace lumel
