#include "lightmap/atlas/own_uvs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "lightmap/atlas/scene_uvs.h"
#include "lightmap/raster.h"

namespace lumel {
namespace {

std::array<Vec2d, 3> texelCorners(const PlacedTriangle& triangle, const Vec2d& pageSize) {
  std::array<Vec2d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = snapToTexelBorder(Vec2d(triangle.uvs[k]) * pageSize);
  return p;
}

}  // namespace

OwnUvs measureOwnUvs(const Scene& scene, const Instance& instance, double texelsPerMeter) {
  OwnUvs own;
  own.low = Vec2d(std::numeric_limits<double>::infinity());
  own.high = -own.low;
  const double density = texelsPerMeter * static_cast<double>(instance.settings.texelDensityScale);
  const glm::dmat3 toTexels = glm::dmat3(Mat3(instance.worldFromObject)) * density;
  double texels = 0, uvArea = 0, logRatio = 0, weight = 0;
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (!receivesLight(scene, instance, primitive)) continue;
    for (std::size_t i = 0; i < primitive.indices.size(); i += 3) {
      std::array<Vec3d, 3> p;
      std::array<Vec2d, 3> uv;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = toTexels * Vec3d(primitive.positions[primitive.indices[i + k]]);
        uv[k] = Vec2d(primitive.uvSets[1][primitive.indices[i + k]]);
        own.low = glm::min(own.low, uv[k]);
        own.high = glm::max(own.high, uv[k]);
      }
      const double area = triangleArea(p[0], p[1], p[2]);
      const double uvTriangle = triangleArea(uv[0], uv[1], uv[2]);
      texels += area;
      uvArea += uvTriangle;
      if (!(uvTriangle > 0) || !(area > 0)) continue;
      const Vec2d a = uv[1] - uv[0], b = uv[2] - uv[0];
      const double alongU = glm::length((p[1] - p[0]) * b.y - (p[2] - p[0]) * a.y);
      const double alongV = glm::length((p[2] - p[0]) * a.x - (p[1] - p[0]) * b.x);
      if (!(alongU > 0) || !(alongV > 0)) continue;
      logRatio += area * std::log(alongU / alongV);
      weight += area;
    }
  }
  if (!(uvArea > 0) || !(texels > 0)) return own;
  const double ratio = weight > 0 ? std::exp(logRatio / weight) : 1.0;
  own.texelsPerUv = Vec2d(std::sqrt(texels / uvArea * ratio), std::sqrt(texels / uvArea / ratio));
  return own;
}

Unwrapped boxChart(const OwnUvs& own, std::size_t triangles) {
  const Vec2 size(own.size());
  Unwrapped result;
  UnwrappedChart& chart = result.charts.emplace_back();
  chart.triangles.resize(triangles);
  std::iota(chart.triangles.begin(), chart.triangles.end(), 0u);
  chart.uvs = {{0, 0}, {size.x, 0}, size, {0, size.y}};
  chart.corners = {{0, 1, 2}, {0, 2, 3}};
  return result;
}

OwnMargins measureMargins(std::span<const PlacedTriangle> triangles, const Vec2d& pageSize) {
  Vec2d low(std::numeric_limits<double>::infinity()), high(-low);
  for (const PlacedTriangle& triangle : triangles)
    for (const Vec2d& p : texelCorners(triangle, pageSize)) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  OwnMargins margins;
  if (triangles.empty()) return margins;
  const int x0 = static_cast<int>(std::floor(low.x)), y0 = static_cast<int>(std::floor(low.y));
  const int width = static_cast<int>(std::ceil(high.x)) - x0, height = static_cast<int>(std::ceil(high.y)) - y0;
  constexpr std::int64_t kFree = -1, kShared = -2;
  std::vector<std::int64_t> charts(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kFree);
  const auto at = [&](int x, int y) -> std::int64_t& {
    return charts[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  };
  for (const PlacedTriangle& triangle : triangles) {
    std::array<Vec2d, 3> p = texelCorners(triangle, pageSize);
    for (Vec2d& q : p) q -= Vec2d(x0, y0);
    forEachTexelSpan(p, {0, 0, width, height}, 0.0, [&](int y, int first, int last) {
      for (int x = first; x < last; ++x) {
        std::int64_t& chart = at(x, y);
        chart = chart == kFree || chart == triangle.chart ? static_cast<std::int64_t>(triangle.chart) : kShared;
      }
    });
  }
  const auto differ = [](std::int64_t a, std::int64_t b) { return a >= 0 && b >= 0 && a != b; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::int64_t here = at(x, y);
      margins.covered += here != kFree ? 1 : 0;
      margins.shared += here == kShared ? 1 : 0;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}})
        if (x + dx >= 0 && x + dx < width && y + dy < height)
          margins.touch = margins.touch || differ(here, at(x + dx, y + dy));
    }
  margins.touch = margins.touch || margins.shared > 0;
  return margins;
}

}  // namespace lumel
