// Surfaces of the atlas from their parts: vertices of the scene with a place on a page.
#pragma once

#include <array>
#include <span>

#include "lightmap/surface.h"

namespace lumel {

/// A triangle of an instance with its place.
struct PlacedTriangle {
  int primitive = 0;
  std::uint32_t triangle = 0;  // of the primitive
  int page = 0;
  std::uint32_t chart = 0;  // into Atlas::charts
  std::array<Vec2, 3> uvs;  // page's 0..1, at the corners in the source's order
};

/// The surfaces of one instance (a primitive and page each, in that order), with normals and bake frames.
/// `triangles` in the order of (primitive, triangle).
std::vector<Surface> makeSurfaces(const Scene& scene, int instance, std::span<const PlacedTriangle> triangles);

}  // namespace lumel
