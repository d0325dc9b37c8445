#include "lightmap/charts/frame_slits.h"

#include <algorithm>

namespace lumel {
namespace {

struct Slit {
  std::uint32_t a = 0, b = 0;  // triangles of the chart on its two sides
};

/// Index in the chart of a triangle of the mesh, or -1.
std::int64_t find(const ChartMesh& chart, std::uint32_t meshTriangle) {
  const auto place = std::lower_bound(chart.meshTriangles.begin(), chart.meshTriangles.end(), meshTriangle);
  return place != chart.meshTriangles.end() && *place == meshTriangle ? place - chart.meshTriangles.begin() : -1;
}

bool findClosed(const FlatChart& chart, const FrameBreak& edge, Slit& slit) {
  const std::int64_t a = find(chart.mesh, edge.cornerA / 3);
  const std::int64_t b = find(chart.mesh, edge.cornerB / 3);
  if (a < 0 || b < 0 || a == b) return false;
  slit = {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)};
  const auto uv = [&chart](std::uint32_t triangle, std::uint32_t k) {
    return chart.uvs[chart.mesh.corners(triangle)[k % 3]];
  };
  const Vec2d start = uv(slit.a, edge.cornerA % 3) - uv(slit.b, edge.cornerB % 3 + 1);
  const Vec2d end = uv(slit.a, edge.cornerA % 3 + 1) - uv(slit.b, edge.cornerB % 3);
  return glm::length(start) < kFrameGap && glm::length(end) < kFrameGap;
}

/// The part of the chart for which keep[triangle] == which, with the UVs that it has.
FlatChart part(const HalfEdgeMesh& mesh, const FlatChart& whole, const std::vector<bool>& keep, bool which) {
  std::vector<std::uint32_t> kept, meshTriangles;  // triangles of the chart, and what they are in the mesh
  std::vector<std::int32_t> index(keep.size(), -1);
  for (std::uint32_t t = 0; t < keep.size(); ++t) {
    if (keep[t] != which) continue;
    index[t] = static_cast<std::int32_t>(kept.size());
    kept.push_back(t);
    meshTriangles.push_back(whole.mesh.meshTriangles[t]);
  }
  std::vector<std::int32_t> opposite;
  for (const std::uint32_t t : kept)
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle side = whole.mesh.beyond(whole.mesh.side(t, k));
      const std::int32_t other = whole.mesh.isBorder(side) ? -1 : index[whole.mesh.triangleOf(side)];
      opposite.push_back(other < 0 ? -1 : 3 * other + static_cast<std::int32_t>(whole.mesh.numberOf(side)));
    }
  FlatChart result;
  result.mesh = ChartMesh(mesh, std::move(meshTriangles), opposite);
  for (const std::uint32_t corner : result.mesh.firstCorners())
    result.uvs.push_back(whole.uvs[whole.mesh.corners(kept[corner / 3])[corner % 3]]);
  return result;
}

}  // namespace

bool isClosed(const FlatChart& chart, const FrameBreak& edge) {
  Slit unused;
  return findClosed(chart, edge, unused);
}

std::vector<FlatChart> splitAtFrameSlits(const HalfEdgeMesh& mesh, std::vector<FlatChart> charts) {
  std::vector<std::uint32_t> chartOf(mesh.size(), 0);
  for (std::uint32_t c = 0; c < charts.size(); ++c)
    for (const std::uint32_t t : charts[c].mesh.meshTriangles) chartOf[t] = c;
  for (const FrameBreak& edge : mesh.frameBreaks) {
    const std::uint32_t c = chartOf[edge.cornerA / 3];
    Slit slit;
    if (c != chartOf[edge.cornerB / 3]) continue;
    if (!findClosed(charts[c], edge, slit)) continue;
    const std::vector<std::uint32_t> fromA = stepsFrom(charts[c].mesh, slit.a).distance;
    const std::vector<std::uint32_t> fromB = stepsFrom(charts[c].mesh, slit.b).distance;
    std::vector<bool> nearA(fromA.size());
    for (std::size_t t = 0; t < nearA.size(); ++t) nearA[t] = fromA[t] <= fromB[t];
    FlatChart other = part(mesh, charts[c], nearA, false);
    charts[c] = part(mesh, charts[c], nearA, true);
    for (const std::uint32_t t : other.mesh.meshTriangles) chartOf[t] = static_cast<std::uint32_t>(charts.size());
    charts.push_back(std::move(other));
  }
  return charts;
}

}  // namespace lumel
