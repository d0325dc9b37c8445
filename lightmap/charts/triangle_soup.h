// The triangles of one object as charts are made from them.
#pragma once

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

}  // namespace lumel
