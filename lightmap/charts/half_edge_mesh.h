// The one door to OpenMesh: a triangle soup becomes a half-edge mesh whose every edge has at most two sides.
// Guéziec, Taubin, Lazarus and Horn 2001, "Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces".
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// Points in texels at nominal density. They are kept as the floats that they are made of, which takes half of the
/// memory, and come out the same each time.
struct TexelPoints {
  std::vector<Vec3> positions;
  glm::dmat3 toTexels{1.0};

  std::size_t size() const { return positions.size(); }
  Vec3d operator[](std::size_t i) const { return toTexels * Vec3d(positions[i]); }
  std::vector<Vec3d> all() const;
};

/// Triangles of one object, counter-clockwise from the front. Arrays but `indices` have one entry per vertex.
struct TriangleSoup {
  TexelPoints points;  // every length below is in texels; equal positions (-0 is 0) are one point, others are not
  std::vector<Vec3> normals;  // shading normals, unit
  std::vector<Vec4> frames;   // material tangent and handedness; w = 0: the material sets no frame
  std::vector<std::uint32_t> indices;

  std::size_t triangleCount() const { return indices.size() / 3; }
};

/// An edge whose two sides have different frames: corner = 3 * triangle + k of the side from corner k to k + 1.
struct FrameBreak {
  std::uint32_t cornerA = 0;
  std::uint32_t cornerB = 0;
};

/// The repaired mesh. Triangles of the soup without area (less than 1e-12 of the longest edge's square) are left out;
/// every other one is in, in the soup's order.
struct HalfEdgeMesh {
  std::vector<std::array<std::uint32_t, 3>> triangles;  // into `points`
  std::vector<std::array<std::int32_t, 3>> neighbours;  // triangle beyond edge (k, k + 1); -1 where none may be joined
  std::vector<std::uint8_t> hardEdges;  // bit k, edge (k, k + 1): the shading normals of its sides differ
  TexelPoints points;
  std::vector<std::uint32_t> leftOut;  // triangles of the soup without area, ascending
  std::vector<FrameBreak> frameBreaks;
  std::size_t nonManifoldEdges = 0;      // more than two sides, or two of contrary winding
  std::size_t selfMeetingTriangles = 0;  // of sheets that meet themselves at both ends of an edge

  std::size_t size() const { return triangles.size(); }
  bool isHard(std::size_t triangle, std::size_t k) const { return (hardEdges[triangle] >> k & 1) != 0; }
  /// A triangle's number in the soup.
  std::uint32_t sourceOf(std::uint32_t triangle) const;
};

/// Joins triangles along edges of equal position. Where more than two meet, opposite sides are paired, flattest pair
/// first. Edges where the material's tangent frame breaks (another tangent, handedness, or a frame on one side only)
/// are not joined. What of the soup is no longer needed is freed on the way.
HalfEdgeMesh buildHalfEdgeMesh(TriangleSoup soup);

}  // namespace lumel
