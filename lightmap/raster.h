// Conservative scan conversion of a triangle: the spans of texels that share positive area with it.
// Used by packing (which texels a chart may touch) and by texel finding (which texels it does touch).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/base/math.h"

namespace lumel {

/// Coordinates this close to a texel border (in texels) lie on it. Page UVs are floats: on a page of 4096 one step is
/// 0.0002 texels, and a chart that ends exactly on a border must not gain a row of texels by rounding.
inline constexpr double kTexelSnap = 1.0 / 1024;

inline double snapToTexelBorder(double x) {
  constexpr double kNoFraction =
      6755399441055744.0;  // 1.5 * 2^52: so large that sums are whole; std::round would be a call
  const double nearest = (x + kNoFraction) - kNoFraction;
  return std::abs(x - nearest) <= kTexelSnap ? nearest : x;
}

inline Vec2d snapToTexelBorder(const Vec2d& p) { return {snapToTexelBorder(p.x), snapToTexelBorder(p.y)}; }

/// Texels [x0, x1) x [y0, y1).
struct TexelWindow {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

/// Calls span(y, x0, x1) for each row y of texels, x in [x0, x1), that shares positive area with the triangle
/// (snapped points in texels; texel (x, y) covers [x, x+1] x [y, y+1]) inside the window. Within one row the triangle's
/// part is convex, so its range in x tells the texels exactly. `margin` widens each row's range by so many texels, but
/// never past the triangle's own box. A triangle without area, or not finite, has no spans.
template <class Span>
void forEachTexelSpan(const std::array<Vec2d, 3>& p, const TexelWindow& window, double margin, Span&& span) {
  const double twiceArea = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
  if (!(std::abs(twiceArea) > 0) || !std::isfinite(twiceArea)) return;
  const auto [minX, maxX] = std::minmax({p[0].x, p[1].x, p[2].x});
  const auto [minY, maxY] = std::minmax({p[0].y, p[1].y, p[2].y});
  const auto floorIn = [](double value, int low, int high) {
    const double inside = std::clamp(value, static_cast<double>(low), static_cast<double>(high));
    const int whole = static_cast<int>(inside);
    return whole - (inside < whole);
  };
  const auto ceilIn = [](double value, int low, int high) {
    const double inside = std::clamp(value, static_cast<double>(low), static_cast<double>(high));
    const int whole = static_cast<int>(inside);
    return whole + (inside > whole);
  };
  const auto emit = [&](int y, double left, double right) {
    const int first = floorIn(left, window.x0, window.x1);
    const int last = ceilIn(right, window.x0, window.x1);
    if (first < last) span(y, first, last);
  };
  const int firstRow = floorIn(minY, window.y0, window.y1);
  const int lastRow = ceilIn(maxY, window.y0, window.y1);
  if (firstRow <= minY && maxY <= firstRow + 1) {  // most triangles are smaller than a texel
    if (firstRow < lastRow) emit(firstRow, minX, maxX);
    return;
  }
  struct Range {
    double left, right;
    void extend(double x) {
      left = std::min(left, x);
      right = std::max(right, x);
    }
  };
  const auto crossing = [&](double border) {
    Range range{maxX, minX};
    if (border <= minY || border > maxY) return range;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec2d& a = p[i];
      const Vec2d& b = p[(i + 1) % 3];
      if ((a.y < border) != (b.y < border)) range.extend(a.x + (b.x - a.x) * ((border - a.y) / (b.y - a.y)));
    }
    return range;
  };
  Range above = crossing(firstRow);
  for (int y = firstRow; y < lastRow; ++y) {
    const Range below = crossing(y + 1);
    Range range{std::min(above.left, below.left), std::max(above.right, below.right)};
    for (const Vec2d& a : p)
      if (a.y >= y && a.y <= y + 1) range.extend(a.x);
    above = below;
    const double left = std::max(minX, range.left - margin);
    const double right = std::min(maxX, range.right + margin);
    if (left < right) emit(y, left, right);
  }
}

}  // namespace lumel
