// Flattened charts that are being joined: UVs shared between charts' corners, and what lies where along their borders.
#pragma once

#include <unordered_map>

#include "lightmap/charts/chart_growing.h"
#include "lightmap/charts/chart_rim.h"
#include "lightmap/charts/flat_chart.h"

namespace lumel {

/// Rotation and shift of the plane.
struct Motion {
  double cosine = 1, sine = 0;
  Vec2d shift{0.0};

  Vec2d apply(Vec2d p) const { return Vec2d(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y) + shift; }
};

/// An edge of the mesh by the triangle that it belongs to: from corner k to k + 1.
struct MeshEdge {
  std::uint32_t triangle = 0;
  std::uint32_t k = 0;
};

/// A way to lay one chart against another: the motion, and the shared edges that then meet.
struct Joint {
  Motion motion;
  std::vector<MeshEdge> matched;
  double length = 0;  // texels of `matched`
};

class ChartSheet {
 public:
  struct Chart {
    std::vector<std::uint32_t> triangles;  // of the mesh
    std::vector<std::uint32_t> vertices;   // of the sheet
    NormalMoments normals;
    double perimeter = 0;  // texels
    Vec2d low{0.0}, high{0.0};
    std::vector<FrameBreak> breaks;  // of the mesh, with a side in this chart and the other in another
    std::unordered_map<std::uint64_t, std::vector<MeshEdge>> border;  // by cell; looked up only
    ChartRim rim;
  };

  /// `breaks`: those of the mesh's whose both sides are in the sheet.
  ChartSheet(const HalfEdgeMesh& mesh, const std::vector<FlatChart*>& charts,
             const std::vector<std::uint32_t>& localTriangle, const std::vector<FrameBreak>& breaks);

  const Chart& chart(std::uint32_t i) const { return charts_[i]; }
  std::uint32_t chartOf(std::uint32_t meshTriangle) const { return chartOf_[localTriangle_[meshTriangle]]; }
  MeshEdge beyond(MeshEdge edge) const;

  /// How a chart may move so that its side of the shared edges meets the other side, from which they are given: the
  /// fit to all of them and to single ones, the longest match first. `slack` multiplies the tolerance.
  std::vector<Joint> fits(const std::vector<MeshEdge>& shared, double slack) const;

  /// Whether `from`, moved and welded at the matched edges, keeps within the limits, lies on nothing of `into`, comes
  /// near to nothing of it that is far on the surface, and leaves kFrameGap texels at breaks of the material's frame.
  bool mayJoin(std::uint32_t into, std::uint32_t from, const Joint& fit, const MergeOptions& options) const;

  void join(std::uint32_t into, std::uint32_t from, const Joint& fit);

  /// The two charts as one mesh, joined along `shared` as well (edges from the side of either), without UVs.
  ChartMesh together(std::uint32_t a, std::uint32_t b, const std::vector<MeshEdge>& shared) const;

  /// Whether a new flattening of both charts lays the sides of a break of the frame against each other.
  bool closesBreak(std::uint32_t a, std::uint32_t b, const FlatChart& flat) const;

  /// Replaces the two charts by `into` with a new flattening of both.
  void replace(std::uint32_t into, std::uint32_t from, const FlatChart& flat);

  /// The chart as a mesh of its own, cut where edges were not welded.
  FlatChart take(std::uint32_t chart) const;

  double length(MeshEdge edge) const;

 private:
  /// A chart as it would lie: moved, with some of its vertices welded.
  struct Welded {
    const Motion& motion;
    std::unordered_map<std::uint32_t, Vec2d> places;  // by vertex; looked up only
  };

  Vec2d placeOf(std::uint32_t triangle, std::uint32_t k, const Welded& welded) const;
  std::uint32_t vertexAt(std::uint32_t triangle, std::uint32_t k) const;
  std::array<Vec2d, 3> corners(std::uint32_t triangle) const;
  template <class Visit>
  void visitCells(Vec2d a, Vec2d b, Visit visit) const;
  void addTriangles(std::uint32_t index, const FlatChart& flat);
  void insertBorder(Chart& chart, MeshEdge edge);
  bool closesBreak(std::uint32_t into, std::uint32_t from, const Welded& welded) const;
  bool liesOn(const Chart& target, std::uint32_t k, const std::array<Vec2d, 3>& uv) const;
  static std::int32_t sideIn(const std::vector<std::uint32_t>& triangles, MeshEdge edge);
  std::vector<std::int32_t> joinedSides(const std::vector<std::uint32_t>& triangles) const;
  void joinBreaks(std::uint32_t into, std::uint32_t from);
  bool staysGood(std::uint32_t triangle, const std::array<Vec2d, 3>& uv, double maxStretch) const;

  const HalfEdgeMesh& mesh_;
  const std::vector<std::uint32_t>& localTriangle_;  // of the mesh's triangles: index within this sheet
  std::vector<Chart> charts_;
  std::vector<std::uint32_t> chartOf_;                      // per local triangle
  std::vector<std::array<std::uint32_t, 3>> cornerVertex_;  // per local triangle
  std::vector<std::array<bool, 3>> joined_;                 // per local triangle and edge
  mutable std::vector<std::uint32_t> parent_;               // union-find over vertices
  std::vector<Vec2d> uvs_;
  double cell_ = 1.0;
};

}  // namespace lumel
