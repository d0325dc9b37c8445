// Visibility of a sky bounded by planes, in closed form.
#pragma once

#include <cmath>
#include <vector>

#include "scene/base/math.h"

namespace lumel::ssbump::closed_forms {

/// Integral of w over an intersection of half spaces on the sphere, by Lambert's formula: half the sum over the edges
/// of arc length times inward normal.
inline Vec3d integrateDirections(const std::vector<Vec3d>& normals) {
  Vec3d sum(0);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Vec3d n = normals[k];
    const Vec3d u = glm::normalize(glm::cross(n, std::abs(n.z) < 0.9 ? Vec3d(0, 0, 1) : Vec3d(1, 0, 0))),
                v = glm::cross(n, u);
    // Each other half space keeps half of this great circle: an arc about the angle where it is deepest inside.
    double centre = 0, half = std::numbers::pi;
    for (std::size_t j = 0; j < normals.size() && half > 0; ++j) {
      if (j == k) continue;
      const double a = std::atan2(glm::dot(normals[j], v), glm::dot(normals[j], u));
      const double offset = std::remainder(a - centre, 2 * std::numbers::pi);
      if (half == std::numbers::pi) {
        centre = a;
        half = std::numbers::pi / 2;
        continue;
      }
      const double lo = std::max(-half, offset - std::numbers::pi / 2),
                   hi = std::min(half, offset + std::numbers::pi / 2);
      half = std::max(0.0, (hi - lo) / 2);
      centre += (hi + lo) / 2;
    }
    sum += n * half;  // arc length 2 * half, times one half
  }
  return sum;
}

/// Visibility around an axis where the sky is what lies above all planes (their normals point to the visible side).
inline double visibilityAbovePlanes(const Vec3& axis, std::vector<Vec3d> planes) {
  const Vec3d b(axis);
  planes.push_back({0, 0, 1});
  if (axis.z < 0.999f) planes.push_back(b);
  return glm::dot(integrateDirections(planes), b) / (std::numbers::pi * (1 + b.z) / 2);
}

/// The side wall of slope H/d towards azimuth phi hides what lies below the plane that leans over by that angle.
inline Vec3d wallPlane(double phi, double slope) {
  const double e = std::atan(slope);
  return {-std::sin(e) * std::cos(phi), -std::sin(e) * std::sin(phi), std::cos(e)};
}

inline constexpr double kEast = 0, kNorth = std::numbers::pi / 2, kWest = std::numbers::pi,
                        kSouth = -std::numbers::pi / 2;

}  // namespace lumel::ssbump::closed_forms
