// The direction of a normal that is interpolated between a triangle's vertices. Without branches, so that loops over
// lanes become vector code.
#pragma once

#include <limits>

#include "scene/base/math.h"

namespace lumel {

/// The square of the length below which unit vertex normals have cancelled and what is left is rounding.
inline constexpr float kLeastNormalSquare = 1e-12f;

/// The length of an interpolated normal, or 0 where it has no direction: its square is not above `leastSquare`, or not
/// finite.
[[gnu::always_inline]] inline float directedLength(const Vec3& normal, float leastSquare = kLeastNormalSquare) {
  const float square = glm::dot(normal, normal);
  const bool isDirected = (square > leastSquare) & (square <= std::numeric_limits<float>::max());
  const float root = std::sqrt(isDirected ? square : 1.0f);
  return isDirected ? root : 0.0f;
}

/// The interpolated normal as a unit vector, or `fallback` where it has no direction.
[[gnu::always_inline]] inline Vec3 unitNormalOr(const Vec3& normal, const Vec3& fallback,
                                                float leastSquare = kLeastNormalSquare) {
  const float length = directedLength(normal, leastSquare);
  const bool isDirected = length > 0.0f;
  const Vec3 unit = normal / (isDirected ? length : 1.0f);
  return {isDirected ? unit.x : fallback.x, isDirected ? unit.y : fallback.y, isDirected ? unit.z : fallback.z};
}

}  // namespace lumel
