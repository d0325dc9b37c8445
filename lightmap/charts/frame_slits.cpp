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
    return chart.uvs[chart.mesh.triangles[triangle][k % 3]];
  };
  const Vec2d start = uv(slit.a, edge.cornerA % 3) - uv(slit.b, edge.cornerB % 3 + 1);
  const Vec2d end = uv(slit.a, edge.cornerA % 3 + 1) - uv(slit.b, edge.cornerB % 3);
  return glm::length(start) < kFrameGap && glm::length(end) < kFrameGap;
}

/// The part of the chart for which keep[triangle] == which, with the UVs that it has.
FlatChart part(const FlatChart& whole, const std::vector<bool>& keep, bool which) {
  FlatChart result;
  result.mesh.points.toTexels = whole.mesh.points.toTexels;
  std::vector<std::int32_t> index(whole.mesh.triangles.size(), -1);
  std::vector<std::int64_t> vertexOf(whole.uvs.size(), -1);
  std::int32_t count = 0;
  for (std::size_t t = 0; t < index.size(); ++t)
    if (keep[t] == which) index[t] = count++;
  for (std::size_t t = 0; t < index.size(); ++t) {
    if (index[t] < 0) continue;
    std::array<std::uint32_t, 3> triangle;
    std::array<std::int32_t, 3> neighbours;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t old = whole.mesh.triangles[t][k];
      if (vertexOf[old] < 0) {
        vertexOf[old] = static_cast<std::int64_t>(result.uvs.size());
        result.uvs.push_back(whole.uvs[old]);
        result.mesh.points.positions.push_back(whole.mesh.points.positions[old]);
      }
      triangle[k] = static_cast<std::uint32_t>(vertexOf[old]);
      const std::int32_t n = whole.mesh.neighbours[t][k];
      neighbours[k] = n < 0 ? -1 : index[static_cast<std::size_t>(n)];
    }
    result.mesh.triangles.push_back(triangle);
    result.mesh.neighbours.push_back(neighbours);
    result.mesh.meshTriangles.push_back(whole.mesh.meshTriangles[t]);
  }
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
    FlatChart other = part(charts[c], nearA, false);
    charts[c] = part(charts[c], nearA, true);
    for (const std::uint32_t t : other.mesh.meshTriangles) chartOf[t] = static_cast<std::uint32_t>(charts.size());
    charts.push_back(std::move(other));
  }
  return charts;
}

}  // namespace lumel
