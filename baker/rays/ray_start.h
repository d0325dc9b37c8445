// Where rays that leave a triangle start: off the surface by a few units in the last place, or on the round surface
// that the vertex normals describe.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "scene/base/math.h"

namespace lumel {

/// Returns how far in metres rays start off a triangle: a few units in the last place of the largest coordinate that
/// takes part in finding a point of it (after Waechter and Binder 2019; without their fixed distance near the origin,
/// so that scenes of any size work). `translation` is the largest coordinate of the instance's translation, for
/// geometry that Embree places itself; 0 else.
inline float offsetDistance(const std::array<Vec3, 3>& corners, float translation) {
  const Vec3 largest = glm::max(glm::max(glm::abs(corners[0]), glm::abs(corners[1])), glm::abs(corners[2]));
  return 8.0f * std::numeric_limits<float>::epsilon() *
         (std::max(std::max(largest.x, largest.y), largest.z) + translation);
}

/// Returns the move that offsetPoint makes; `inwards` is the sum of the vectors to the triangle's corners.
inline Vec3 rayOffset(const Vec3& ng, const Vec3& inwards, float distance) {
  const float reach = glm::length(inwards);
  // At most half the way to the centroid, which lies at inwards / 3.
  const float share = reach > 6.0f * distance ? distance / reach : 1.0f / 6.0f;
  return ng * distance + inwards * share;
}

/// Returns the start of a ray that leaves p, a point of the triangle, on the side of ng. It is moved by offsetDistance
/// along the normal, so that rounding cannot put it behind the surface, and as far towards the triangle's centroid, so
/// that it cannot lie beyond a wall that stands on the triangle's edge.
inline Vec3 offsetPoint(const Vec3& p, const Vec3& ng, const std::array<Vec3, 3>& corners, float translation) {
  return p +
         rayOffset(ng, (corners[0] - p) + (corners[1] - p) + (corners[2] - p), offsetDistance(corners, translation));
}

/// Returns how far unit normals at a triangle's corners describe a surface that is rounded outwards over it, 0 to 1:
/// they spread along its edges. A column of six sides (30 degrees) and a sphere of 8 x 5 are wholly round. From 35 to
/// 44 degrees of lean the share falls to nothing, without a step: normals that lean as those of a box with smooth edges
/// (45) are a look and not a shape.
inline float roundedShare(const Vec3& ng, const Vec3& e1, const Vec3& e2, const std::array<Vec3, 3>& normals) {
  constexpr float kWholeCosine = 0.82f, kNoCosine = 0.72f;
  float least = 1.0f;
  for (const Vec3& normal : normals) least = std::min(least, glm::dot(ng, normal));
  if (!(least > kNoCosine)) return 0.0f;
  const std::array<float, 3> spread = {glm::dot(normals[1] - normals[0], e1), glm::dot(normals[2] - normals[0], e2),
                                       glm::dot(normals[2] - normals[1], e2 - e1)};
  const float most = std::max({spread[0], spread[1], spread[2]});
  if (!(most > 1e-4f * std::sqrt(std::max(glm::dot(e1, e1), glm::dot(e2, e2))))) return 0.0f;
  if (!(std::min({spread[0], spread[1], spread[2]}) > -0.01f * most)) return 0.0f;
  const float share = std::min((least - kNoCosine) / (kWholeCosine - kNoCosine), 1.0f);
  return share * share * (3.0f - 2.0f * share);
}

/// Returns the way from a point of a rounded triangle out to the surface that its unit normals describe, or zero where
/// that bends inwards.
/// Rays that go below the plane of the facet, and above the round surface, start there, so that they do not meet the
/// round thing itself, which would show as black facets where its shade begins (after Hanika 2021, "Hacking the Shadow
/// Terminator"). All others start on the facet: further out they would miss what stands over it, such as the rim of a
/// basin. The point lies at `fromFirst` = b.x e1 + b.y e2 from
/// the first corner.
inline Vec3 liftToRound(const Vec3& fromFirst, const Vec3& e1, const Vec3& e2, const Vec2& b,
                        const std::array<Vec3, 3>& normals) {
  const auto below = [](const Vec3& fromCorner, const Vec3& normal) {
    const float depth = -glm::dot(fromCorner, normal);
    return (depth > 0.0f ? depth : 0.0f) * normal;
  };
  return (1.0f - b.x - b.y) * below(fromFirst, normals[0]) + b.x * below(fromFirst - e1, normals[1]) +
         b.y * below(fromFirst - e2, normals[2]);
}

/// Tells whether rays that go below the facet start at the lifted place (`lift` by liftToRound): where it lies further
/// out than the plain offset. Elsewhere there are no such rays.
inline bool isLifted(const Vec3& lift, const Vec3& ng, float offsetMeters) { return glm::dot(lift, ng) > offsetMeters; }

}  // namespace lumel
