// Conservative scan conversion of a triangle: the spans of texels that share positive area with it.
// Used by packing (which texels a chart may touch) and by texel finding (which texels it does touch).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/math.h"

namespace lumel {

/// Coordinates this close to a texel border (in texels) lie on it. Page UVs are floats: on a page of 4096 one step is
/// 0.0002 texels, and a chart that ends exactly on a border must not gain a row of texels by rounding.
inline constexpr double kTexelSnap = 1.0 / 1024;

inline double snapToTexelBorder(double x) {
  const double nearest = std::round(x);
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
  const auto inWindow = [](double value, int low, int high) {
    return static_cast<int>(std::clamp(value, static_cast<double>(low), static_cast<double>(high)));
  };
  const int lastRow = inWindow(std::ceil(maxY), window.y0, window.y1);
  for (int y = inWindow(std::floor(minY), window.y0, window.y1); y < lastRow; ++y) {
    double left = maxX;
    double right = minX;
    const auto extend = [&left, &right](double x) {
      left = std::min(left, x);
      right = std::max(right, x);
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec2d& a = p[i];
      const Vec2d& b = p[(i + 1) % 3];
      if (a.y >= y && a.y <= y + 1) extend(a.x);
      for (const double border : {static_cast<double>(y), static_cast<double>(y + 1)})
        if ((a.y < border) != (b.y < border)) extend(a.x + (b.x - a.x) * ((border - a.y) / (b.y - a.y)));
    }
    left = std::max(minX, left - margin);
    right = std::min(maxX, right + margin);
    if (!(left < right)) continue;
    const int first = inWindow(std::floor(left), window.x0, window.x1);
    const int last = inWindow(std::ceil(right), window.x0, window.x1);
    if (first < last) span(y, first, last);
  }
}

}  // namespace lumel
