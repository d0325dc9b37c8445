// Where the borders of charts meet in space and light goes on: pairs of edges, and points along them at which lookups
// from both sides shall agree.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "lightmap/surface.h"

namespace lumel {

/// One side of a pair: the plane of its triangle, unfolded about the common part of the two edges.
struct SeamSide {
  std::uint32_t page = 0;
  std::uint32_t chart = 0;  // into Atlas::charts
  Vec2d start{0};           // of the common part, on the page in texels
  Vec2d along{0};           // texels per metre along the edge
  Vec2d out{0};             // texels per metre across the edge, away from the triangle
  Frame frame;              // the bake frame in the middle of the common part, world

  /// The place on the page: `along` metres from the start, `out` metres beyond the edge.
  Vec2d at(const Vec2d& alongOut) const { return start + along * alongOut.x + out * alongOut.y; }
  /// Its inverse.
  Vec2d inMetres(const Vec2d& texel) const;
};

/// Two edges of which a part coincides in space; both sides look the same way, and neither continues the other on a
/// page.
struct SeamPair {
  std::array<SeamSide, 2> sides;
  double length = 0.0;  // of the common part, metres
};

/// A point of a pair at which nothing stands between its sides.
struct SeamPoint {
  std::uint32_t pair = 0;
  float metres = 0.0f;  // from the start of the common part
  float texels = 0.0f;  // of the edge that it stands for, at the finer side's density
};

struct Seams {
  std::vector<SeamPair> pairs;
  std::vector<SeamPoint> points;  // in order of pairs
};

/// A short way over the surface from one side of a seam to the other, world.
struct SeamCrossing {
  Vec3 from{0};
  Vec3 to{0};
};
/// Sets `blocked` (one entry per crossing, 0 at first) where something stands in the way.
using BlockedCrossings = std::function<void(std::span<const SeamCrossing>, std::span<std::uint8_t> blocked)>;

/// Finds all pairs within and across charts, objects and pages, also where an edge meets a part of another. Edges
/// coincide where they are at most a twentieth of a texel apart; shading normals may differ by 3 degrees, triangles
/// may bend by 60 (smooth shading). Points lie half a texel apart. Cells of space that hold more than 2000 edges are
/// left alone. Deterministic. Memory: 250 bytes per border edge,
/// 200 per pair and 40 per point.
Seams findSeams(const Atlas& atlas, const BlockedCrossings& blocked);

}  // namespace lumel
