// A rectangle as a point sees it, sampled evenly by solid angle. Urena, Fajardo and King 2013, "An Area-Preserving
// Parametrization for Spherical Rectangles".
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/base/math.h"

namespace lumel {

class SphericalRectangle {
 public:
  /// The rectangle with a corner at `corner` and the sides size.x and size.y along the unit vectors x and y, which
  /// stand upright on each other, as seen from p. Precondition: p does not lie in its plane.
  SphericalRectangle(const Vec3d& p, const Vec3d& corner, const Vec3d& x, const Vec3d& y, const Vec2d& size)
      : p_(p), x_(x), y_(y), z_(glm::cross(x, y)) {
    const Vec3d d = corner - p;
    x0_ = glm::dot(d, x_);
    y0_ = glm::dot(d, y_);
    z0_ = glm::dot(d, z_);
    if (z0_ > 0.0) {  // the rectangle lies on the side of -z
      z_ = -z_;
      z0_ = -z0_;
    }
    x1_ = x0_ + size.x;
    y1_ = y0_ + size.y;
    // Normals of the planes through p and the four sides; each has one component that is zero.
    const Vec3d n0 = glm::normalize(Vec3d(0.0, z0_, -y0_)), n1 = glm::normalize(Vec3d(-z0_, 0.0, x1_));
    const Vec3d n2 = glm::normalize(Vec3d(0.0, -z0_, y1_)), n3 = glm::normalize(Vec3d(z0_, 0.0, -x0_));
    const auto angle = [](const Vec3d& a, const Vec3d& b) { return std::acos(std::clamp(-glm::dot(a, b), -1.0, 1.0)); };
    const double g0 = angle(n0, n1), g1 = angle(n1, n2), g2 = angle(n2, n3), g3 = angle(n3, n0);
    b0_ = n0.z;
    b1_ = n2.z;
    k_ = 2.0 * std::numbers::pi - g2 - g3;
    solidAngle_ = std::max(0.0, g0 + g1 - k_);
  }

  double solidAngle() const { return solidAngle_; }

  /// Returns a point of the rectangle. Density per solid angle: 1 / solidAngle().
  Vec3d sample(const Vec2d& u) const {
    const double au = u.x * solidAngle_ + k_;
    const double fu = (std::cos(au) * b0_ - b1_) / std::sin(au);
    const double cu = std::clamp(std::copysign(1.0 / std::sqrt(fu * fu + b0_ * b0_), fu), -1.0, 1.0);
    const double xu = std::clamp(-(cu * z0_) / std::max(std::sqrt(1.0 - cu * cu), 1e-12), x0_, x1_);
    const double d2 = xu * xu + z0_ * z0_;
    const double h0 = y0_ / std::sqrt(d2 + y0_ * y0_), h1 = y1_ / std::sqrt(d2 + y1_ * y1_);
    const double hv = h0 + u.y * (h1 - h0);
    const double rest = 1.0 - hv * hv;
    const double yv = rest > 1e-12 ? std::clamp(hv * std::sqrt(d2 / rest), y0_, y1_) : (hv > 0.0 ? y1_ : y0_);
    return p_ + xu * x_ + yv * y_ + z0_ * z_;
  }

 private:
  Vec3d p_, x_, y_, z_;
  double x0_ = 0.0, y0_ = 0.0, z0_ = 0.0, x1_ = 0.0, y1_ = 0.0;
  double b0_ = 0.0, b1_ = 0.0, k_ = 0.0;
  double solidAngle_ = 0.0;
};

}  // namespace lumel
