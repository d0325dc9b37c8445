// The borders of charts as edges in space, and which of them lie near each other.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "lightmap/surface.h"

namespace lumel {

/// An edge of a triangle beyond which its chart does not go on, in world space and on the page.
struct BorderEdge {
  std::uint32_t surface = 0;  // into Atlas::surfaces
  std::uint32_t triangle = 0;
  std::uint32_t corner = 0;  // the edge runs from this corner of the triangle to the next
  std::uint32_t chart = 0;   // into Atlas::charts
  Vec3d start{0};
  Vec3d end{0};
  Vec3d direction{0};  // unit
  double length = 0.0;
  Vec3d normal{0};                                    // of the triangle
  Vec3d outwards{0};                                  // unit, in its plane, off the edge
  Vec2d startTexel{0};                                // on the page
  std::array<Vec2d, 2> perMetre{Vec2d(0), Vec2d(0)};  // texels along the direction, and outwards
  double metresPerTexel = 0.0;                        // of the triangle, the coarser of both ways

  Vec3d pointAt(const Vec2d& texelOnEdge) const;
};

/// All of them, but of triangles without area in space or on the page. In order of surfaces and triangles.
std::vector<BorderEdge> borderEdges(const Atlas& atlas);

/// The bake frame on an edge, at a share of it from its start.
Frame frameOn(const Atlas& atlas, const BorderEdge& edge, double share);

/// Every two edges that come near each other somewhere, in ascending order, each once; others may be among them.
std::vector<std::pair<std::uint32_t, std::uint32_t>> neighboursOf(const std::vector<BorderEdge>& edges);

}  // namespace lumel
