// Whether two triangles of a plane lie on each other.
#pragma once

#include <algorithm>
#include <array>

#include "scene/base/math.h"

namespace lumel {

/// Parts of a chart may lie on each other by less (texels): far below the distance of two samples.
inline constexpr double kOverlapTexels = 2e-3;

/// Whether a line along an edge of `a` (counter-clockwise) leaves `b` outside, an overlap of less than `tolerance`
/// (in the units of the corners) forgiven. Zero-length edges separate nothing.
inline bool edgeSeparates(const std::array<Vec2d, 3>& a, const std::array<Vec2d, 3>& b, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d edge = a[(k + 1) % 3] - a[k];
    const double length = glm::length(edge);
    if (!(length > 0)) continue;
    const Vec2d outward(edge.y / length, -edge.x / length);
    const double reach =
        std::min({glm::dot(outward, b[0] - a[k]), glm::dot(outward, b[1] - a[k]), glm::dot(outward, b[2] - a[k])});
    if (reach > -tolerance) return true;
  }
  return false;
}

/// Separating axes of two counter-clockwise triangles that both have area.
inline bool trianglesOverlap(const std::array<Vec2d, 3>& a, const std::array<Vec2d, 3>& b, double tolerance) {
  return !edgeSeparates(a, b, tolerance) && !edgeSeparates(b, a, tolerance);
}

}  // namespace lumel
