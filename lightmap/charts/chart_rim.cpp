#include "lightmap/charts/chart_rim.h"

#include <cmath>

namespace lumel {
namespace {

constexpr double kNearTexels = 1.5;  // a texel's diagonal, and what snapping and the search for a density may take off
constexpr double kFarTexels = 4.0;   // on the surface: a slit of less is a detail that a lightmap blurs anyway

std::int64_t cellOf(double x) { return static_cast<std::int64_t>(std::floor(x / kNearTexels)); }

/// Whether any point of the edge but its last, which is another edge's first, is what `visit` looks for.
template <class Visit>
bool anyPoint(const ChartRim::Edge& edge, Visit visit) {
  const int steps = 1 + static_cast<int>(std::min(1e6, glm::length(edge.uvB - edge.uvA)));
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    if (visit(edge.uvA + s * (edge.uvB - edge.uvA), edge.a + s * (edge.b - edge.a))) return true;
  }
  return false;
}

}  // namespace

void ChartRim::add(const Edge& edge) {
  anyPoint(edge, [this](Vec2d uv, const Vec3d& place) {
    cells_[cellKey(cellOf(uv.x), cellOf(uv.y))].push_back({uv, place});
    return false;
  });
}

bool ChartRim::mixesWith(const Edge& edge) const {
  return anyPoint(edge, [this](Vec2d uv, const Vec3d& place) {
    for (std::int64_t y = cellOf(uv.y) - 1; y <= cellOf(uv.y) + 1; ++y)
      for (std::int64_t x = cellOf(uv.x) - 1; x <= cellOf(uv.x) + 1; ++x) {
        const auto cell = cells_.find(cellKey(x, y));
        if (cell == cells_.end()) continue;
        for (const Point& point : cell->second) {
          const Vec2d gap = point.uv - uv;
          const Vec3d way = point.place - place;
          if (glm::dot(gap, gap) < kNearTexels * kNearTexels && glm::dot(way, way) > kFarTexels * kFarTexels)
            return true;
        }
      }
    return false;
  });
}

bool mixesFarParts(const ChartMesh& chart, std::span<const Vec2d> uvs) {
  ChartRim rim;
  std::vector<ChartRim::Edge> edges;
  for (std::size_t t = 0; t < chart.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle side = chart.side(t, k);
      if (!chart.isBorder(chart.beyond(side))) continue;
      const std::uint32_t i = chart.startOf(side);
      const std::uint32_t j = chart.endOf(side);
      edges.push_back({uvs[i], uvs[j], chart.points[i], chart.points[j]});
    }
  for (const ChartRim::Edge& edge : edges) {
    if (rim.mixesWith(edge)) return true;
    rim.add(edge);
  }
  return false;
}

}  // namespace lumel
