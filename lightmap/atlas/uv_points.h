// Sample points of a page, and which of them a triangle covers: for measuring overlap.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// 4 x 4 points per texel with a bit each. Triangles cover points by the half-open rule: one on a shared edge belongs
/// to one of the two triangles.
class UvPoints {
 public:
  static constexpr int kPerTexel = 4;
  static constexpr double kTexelsPerPoint = 1.0 / (kPerTexel * kPerTexel);

  UvPoints(int width, int height)
      : width_(width * kPerTexel),
        height_(height * kPerTexel),
        bits_((static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) + 63) / 64, 0) {}

  bool test(std::size_t i) const { return (bits_[i / 64] >> (i % 64)) & 1u; }
  void set(std::size_t i) { bits_[i / 64] |= std::uint64_t{1} << (i % 64); }

  /// Calls visit(index) for every point inside the triangle, given in texels.
  template <class Visit>
  void forEach(std::array<Vec2d, 3> texels, Visit visit) const {
    for (Vec2d& p : texels) p *= static_cast<double>(kPerTexel);
    forEachCentre(texels, width_, height_, [&](int x, int y) {
      visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
    });
  }

  /// Calls visit(x, y) for every cell of a width x height grid whose centre is inside the triangle.
  template <class Visit>
  static void forEachCentre(std::array<Vec2d, 3> p, int width, int height, Visit visit) {
    for (Vec2d& q : p) {
      q -= 0.5;  // centres at whole numbers
      if (!std::isfinite(q.x) || !std::isfinite(q.y)) return;
    }
    const double top = std::max(0.0, std::ceil(std::min({p[0].y, p[1].y, p[2].y})));
    const double bottom = std::min<double>(height, std::ceil(std::max({p[0].y, p[1].y, p[2].y})));
    for (int y = static_cast<int>(std::min<double>(top, height)); y < bottom; ++y) {
      double left = std::numeric_limits<double>::infinity(), right = -left;
      for (std::size_t k = 0; k < 3; ++k) {
        // Edges run from low to high so that both triangles of an edge compute the same crossing.
        const bool swap = p[k].y > p[(k + 1) % 3].y;
        const Vec2d a = swap ? p[(k + 1) % 3] : p[k];
        const Vec2d b = swap ? p[k] : p[(k + 1) % 3];
        if (!(a.y <= y && y < b.y)) continue;
        const double x = a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
        left = std::min(left, x);
        right = std::max(right, x);
      }
      if (!(left < right)) continue;
      const double last = std::min<double>(width, std::ceil(right));
      for (int x = static_cast<int>(std::clamp(std::ceil(left), 0.0, static_cast<double>(width))); x < last; ++x)
        visit(x, y);
    }
  }

 private:
  int width_;
  int height_;
  std::vector<std::uint64_t> bits_;
};

}  // namespace lumel
