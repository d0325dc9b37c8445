// A triangle soup becomes a half-edge mesh whose every edge has at most two sides.
// Guéziec, Taubin, Lazarus and Horn 2001, "Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces".
#pragma once

#include "lightmap/charts/triangle_connectivity.h"
#include "lightmap/charts/triangle_soup.h"

namespace lumel {

/// An edge whose two sides have different frames: corner = 3 * triangle + k of the side from corner k to k + 1.
struct FrameBreak {
  std::uint32_t cornerA = 0;
  std::uint32_t cornerB = 0;
};

/// The repaired mesh. Triangles of the soup without area (less than 1e-12 of the longest edge's square) are left out;
/// every other one is in, in the soup's order.
struct HalfEdgeMesh : TriangleConnectivity {
  TexelPoints points;                   // per vertex
  std::vector<std::uint8_t> hardEdges;  // per triangle; bit k: the shading normals of the sides of its edge k differ
  std::vector<std::uint32_t> leftOut;   // triangles of the soup without area, ascending
  std::vector<FrameBreak> frameBreaks;
  std::size_t nonManifoldEdges = 0;  // more than two sides, or two of contrary winding

  bool isHard(std::size_t triangle, std::size_t k) const { return (hardEdges[triangle] >> k & 1) != 0; }
  /// A triangle's number in the soup.
  std::uint32_t sourceOf(std::uint32_t triangle) const;
};

/// Joins triangles along edges of equal position. Where more than two meet, opposite sides are paired, flattest pair
/// first. Edges where the material's tangent frame breaks (another tangent, handedness, or a frame on one side only)
/// are not joined. What of the soup is no longer needed is freed on the way.
HalfEdgeMesh buildHalfEdgeMesh(TriangleSoup soup);

}  // namespace lumel
