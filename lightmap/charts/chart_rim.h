// Borders of a flattened chart as points, to find where it comes near to itself on the page but not on the surface.
#pragma once

#include <unordered_map>
#include <vector>

#include "lightmap/charts/chart_mesh.h"

namespace lumel {

/// Key of a cell of a grid without bounds, for hash tables.
inline std::uint64_t cellKey(std::int64_t x, std::int64_t y) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) | static_cast<std::uint32_t>(y);
}

/// Points along a chart's border, a texel apart or less, with their places in the texture and on the surface (texels).
class ChartRim {
 public:
  struct Edge {
    Vec2d uvA{0.0}, uvB{0.0};
    Vec3d a{0.0}, b{0.0};
  };

  void add(const Edge& edge);

  /// Whether a point of the edge lies so near to one of the rim that one texel can hold both, though they are far apart
  /// on the surface: that texel would mix the light of two places.
  bool mixesWith(const Edge& edge) const;

 private:
  struct Point {
    Vec2d uv{0.0};
    Vec3d place{0.0};
  };
  std::unordered_map<std::uint64_t, std::vector<Point>> cells_;  // looked up only
};

/// Whether any texel can hold two places of the chart that are far apart on the surface.
bool mixesFarParts(const ChartMesh& chart, std::span<const Vec2d> uvs);

}  // namespace lumel
