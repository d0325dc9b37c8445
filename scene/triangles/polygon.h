// Polygons to triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// Newell's normal of a polygon of any shape, not quite planar ones too: twice its area, towards the side from which it
/// runs counter-clockwise.
Vec3d newellNormal(std::span<const Vec3> corners);

/// corners.size() - 2 triangles over the polygon's corners, wound as it is. Concave polygons are cut by ear
/// clipping in the plane of their Newell normal; a quad by the diagonal that keeps both halves on its inside, the
/// shorter if both do. A polygon that crosses itself or has no area gives some triangles of it, never an error.
std::vector<std::array<std::uint32_t, 3>> triangulatePolygon(std::span<const Vec3> corners);

}  // namespace lumel
