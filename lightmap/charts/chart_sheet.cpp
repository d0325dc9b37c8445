#include "lightmap/charts/chart_sheet.h"

#include <algorithm>
#include <cmath>

#include "lightmap/charts/frame_slits.h"
#include "lightmap/charts/triangle_overlap.h"
#include "scene/base/union_find.h"

namespace lumel {
namespace {

constexpr double kMatchTexels = 0.25;  // how far welding may move a point
constexpr double kMatchShare = 0.05;   // ... and of the edge's length
constexpr std::size_t kSeeds = 4;      // edges that are tried as the one that matches

double doubleArea(const std::array<Vec2d, 3>& t) { return cross2(t[1] - t[0], t[2] - t[0]); }

/// Best motion of points `b` onto points `a` (Procrustes in the plane).
Motion procrustes(const std::vector<std::array<Vec2d, 4>>& edges) {
  double weight = 0;
  Vec2d centreA(0.0), centreB(0.0);
  for (const auto& e : edges) {
    const double w = glm::length(e[1] - e[0]) + 1e-12;
    weight += 2 * w;
    centreA += w * (e[0] + e[1]);
    centreB += w * (e[2] + e[3]);
  }
  centreA /= weight;
  centreB /= weight;
  double cosine = 0, sine = 0;
  for (const auto& e : edges) {
    const double w = glm::length(e[1] - e[0]) + 1e-12;
    for (std::size_t i = 0; i < 2; ++i) {
      cosine += w * glm::dot(e[2 + i] - centreB, e[i] - centreA);
      sine += w * cross2(e[2 + i] - centreB, e[i] - centreA);
    }
  }
  const double size = std::hypot(cosine, sine);
  Motion motion;
  if (size > 0) {
    motion.cosine = cosine / size;
    motion.sine = sine / size;
  }
  motion.shift = centreA - motion.apply(centreB);
  return motion;
}

bool matches(const std::array<Vec2d, 4>& e, const Motion& motion, double slack) {
  const double limit = std::min(kMatchTexels, kMatchShare * slack * glm::length(e[1] - e[0]) + 1e-6);
  return glm::length(motion.apply(e[2]) - e[0]) <= limit && glm::length(motion.apply(e[3]) - e[1]) <= limit;
}

}  // namespace

ChartSheet::ChartSheet(const HalfEdgeMesh& mesh, const std::vector<FlatChart*>& charts,
                       const std::vector<std::uint32_t>& localTriangle, const std::vector<FrameBreak>& breaks)
    : mesh_(mesh), localTriangle_(localTriangle) {
  std::size_t triangles = 0;
  for (const FlatChart* flat : charts) triangles += flat->mesh.size();
  chartOf_.resize(triangles);
  cornerVertex_.resize(triangles);
  joined_.resize(triangles);
  charts_.resize(charts.size());
  double borderLength = 0;
  std::size_t borderEdges = 0;
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    addTriangles(c, *charts[c]);
    borderLength += charts_[c].perimeter;
    for (const OpenMesh::EdgeHandle edge : charts[c]->mesh.halfEdges().edges())
      borderEdges += charts[c]->mesh.halfEdges().is_boundary(edge);
  }
  constexpr double kLargestCell = 4.0;
  cell_ = std::min(kLargestCell, borderLength / static_cast<double>(std::max<std::size_t>(borderEdges, 1)));
  for (Chart& chart : charts_)
    for (const std::uint32_t t : chart.triangles)
      for (std::uint32_t k = 0; k < 3; ++k)
        if (!joined_[localTriangle_[t]][k]) insertBorder(chart, {t, k});
  for (const FrameBreak& edge : breaks) {
    const std::uint32_t a = chartOf(edge.cornerA / 3);
    const std::uint32_t b = chartOf(edge.cornerB / 3);
    if (a == b) continue;
    charts_[a].breaks.push_back(edge);
    charts_[b].breaks.push_back(edge);
  }
}

/// Sets a chart from its own mesh; its border is not yet entered in the cells.
void ChartSheet::addTriangles(std::uint32_t index, const FlatChart& flat) {
  Chart& chart = charts_[index];
  chart = {};
  const auto base = static_cast<std::uint32_t>(uvs_.size());
  uvs_.insert(uvs_.end(), flat.uvs.begin(), flat.uvs.end());
  for (std::uint32_t i = 0; i < flat.uvs.size(); ++i) {
    chart.vertices.push_back(base + i);
    parent_.push_back(base + i);
  }
  chart.triangles = flat.mesh.meshTriangles;
  chart.low = chart.high = flat.uvs[0];
  for (const Vec2d uv : flat.uvs) {
    chart.low = glm::min(chart.low, uv);
    chart.high = glm::max(chart.high, uv);
  }
  for (std::size_t t = 0; t < flat.mesh.size(); ++t) {
    const std::uint32_t triangle = flat.mesh.meshTriangles[t];
    const std::uint32_t local = localTriangle_[triangle];
    chartOf_[local] = index;
    chart.normals = NormalMoments(chart.normals, NormalMoments(areaNormal(mesh_, triangle)));
    for (std::uint32_t k = 0; k < 3; ++k) {
      cornerVertex_[local][k] = base + flat.mesh.startOf(flat.mesh.side(t, k));
      joined_[local][k] = flat.mesh.neighbour(t, k) >= 0;
      if (!joined_[local][k]) chart.perimeter += length({triangle, k});
    }
  }
}

std::uint32_t ChartSheet::vertexAt(std::uint32_t triangle, std::uint32_t k) const {
  return findRoot(parent_, cornerVertex_[localTriangle_[triangle]][k]);
}

std::array<Vec2d, 3> ChartSheet::corners(std::uint32_t triangle) const {
  return {uvs_[vertexAt(triangle, 0)], uvs_[vertexAt(triangle, 1)], uvs_[vertexAt(triangle, 2)]};
}

MeshEdge ChartSheet::beyond(MeshEdge edge) const {
  const HalfedgeHandle side = mesh_.beyond(mesh_.side(edge.triangle, edge.k));
  return {mesh_.triangleOf(side), mesh_.numberOf(side)};
}

double ChartSheet::length(MeshEdge edge) const {
  const std::array<std::uint32_t, 3> v = mesh_.corners(edge.triangle);
  return glm::length(mesh_.points[v[(edge.k + 1) % 3]] - mesh_.points[v[edge.k]]);
}

/// Cells along a segment, each at least once.
template <class Visit>
void ChartSheet::visitCells(Vec2d a, Vec2d b, Visit visit) const {
  const double low = std::min(a.y, b.y);
  const double high = std::max(a.y, b.y);
  const auto index = [this](double x) { return static_cast<std::int64_t>(std::floor(x / cell_)); };
  for (std::int64_t y = index(low); y <= index(high); ++y) {
    const double y0 = static_cast<double>(y) * cell_;
    double x0 = a.x, x1 = b.x;
    if (a.y != b.y) {
      const double s0 = std::clamp((y0 - a.y) / (b.y - a.y), 0.0, 1.0);
      const double s1 = std::clamp((y0 + cell_ - a.y) / (b.y - a.y), 0.0, 1.0);
      x0 = a.x + s0 * (b.x - a.x);
      x1 = a.x + s1 * (b.x - a.x);
    }
    for (std::int64_t x = index(std::min(x0, x1)); x <= index(std::max(x0, x1)); ++x) visit(cellKey(x, y));
  }
}

void ChartSheet::insertBorder(Chart& chart, MeshEdge edge) {
  const Vec2d a = uvs_[vertexAt(edge.triangle, edge.k)];
  const Vec2d b = uvs_[vertexAt(edge.triangle, (edge.k + 1) % 3)];
  visitCells(a, b, [&](std::uint64_t key) { chart.border[key].push_back(edge); });
  const std::array<std::uint32_t, 3> v = mesh_.corners(edge.triangle);
  chart.rim.add({a, b, mesh_.points[v[edge.k]], mesh_.points[v[(edge.k + 1) % 3]]});
}

std::vector<Joint> ChartSheet::fits(const std::vector<MeshEdge>& shared, double slack) const {
  std::vector<std::array<Vec2d, 4>> edges;  // ends in `into`, then the same ends in `from`
  for (const MeshEdge into : shared) {
    const MeshEdge from = beyond(into);
    edges.push_back({uvs_[vertexAt(into.triangle, into.k)], uvs_[vertexAt(into.triangle, (into.k + 1) % 3)],
                     uvs_[vertexAt(from.triangle, (from.k + 1) % 3)], uvs_[vertexAt(from.triangle, from.k)]});
  }
  std::vector<std::vector<std::array<Vec2d, 4>>> seeds = {edges};
  std::vector<std::size_t> order(edges.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return glm::length(edges[a][1] - edges[a][0]) > glm::length(edges[b][1] - edges[b][0]);
  });
  const std::size_t singles = edges.size() > 1 ? std::min<std::size_t>(kSeeds, edges.size()) : 0;
  for (std::size_t i = 0; i < singles; ++i) seeds.push_back({edges[order[i * order.size() / singles]]});

  std::vector<Joint> found;
  for (const auto& seed : seeds) {
    Joint best;
    Motion trial = procrustes(seed);
    for (int refinement = 0; refinement < 2; ++refinement) {
      std::vector<std::array<Vec2d, 4>> good;
      Joint fit{trial, {}, 0};
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (!matches(edges[i], trial, slack)) continue;
        good.push_back(edges[i]);
        fit.matched.push_back(shared[i]);
        fit.length += glm::length(edges[i][1] - edges[i][0]);
      }
      if (good.empty()) break;
      if (fit.length > best.length * (1 + 1e-9)) best = std::move(fit);
      trial = procrustes(good);
    }
    const bool complete = best.matched.size() == edges.size();
    if (best.length > 0) found.push_back(std::move(best));
    if (complete) break;
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Joint& a, const Joint& b) { return a.length > b.length * (1 + 1e-9); });
  return found;
}

bool ChartSheet::staysGood(std::uint32_t triangle, const std::array<Vec2d, 3>& uv, double maxStretch) const {
  const std::array<std::uint32_t, 3> v = mesh_.corners(triangle);
  // A sliver may lie turned over by less than a float UV can tell, but no further.
  if (!(doubleArea(uv) > 0)) return !(doubleArea(corners(triangle)) > 0) && !isFlipped(uv);
  const FlatTriangle surface = layFlat({mesh_.points[v[0]], mesh_.points[v[1]], mesh_.points[v[2]]});
  return singularValues(surface, uv).within(maxStretch);
}

Vec2d ChartSheet::placeOf(std::uint32_t triangle, std::uint32_t k, const Welded& welded) const {
  const std::uint32_t vertex = vertexAt(triangle, k % 3);
  const auto place = welded.places.find(vertex);
  return place != welded.places.end() ? place->second : welded.motion.apply(uvs_[vertex]);
}

bool ChartSheet::closesBreak(std::uint32_t into, std::uint32_t from, const Welded& welded) const {
  const bool fewer = charts_[from].breaks.size() < charts_[into].breaks.size();
  for (const FrameBreak& edge : charts_[fewer ? from : into].breaks) {
    const std::uint32_t a = chartOf(edge.cornerA / 3);
    const std::uint32_t b = chartOf(edge.cornerB / 3);
    if (!(a == into && b == from) && !(a == from && b == into)) continue;
    const std::uint32_t still = a == into ? edge.cornerA : edge.cornerB;
    const std::uint32_t moved = a == into ? edge.cornerB : edge.cornerA;
    const Vec2d start = uvs_[vertexAt(still / 3, still % 3)] - placeOf(moved / 3, moved % 3 + 1, welded);
    const Vec2d end = uvs_[vertexAt(still / 3, (still + 1) % 3)] - placeOf(moved / 3, moved % 3, welded);
    if (glm::length(start) < kFrameGap && glm::length(end) < kFrameGap) return true;
  }
  return false;
}

/// Whether a triangle with an edge on the border, moved to `uv`, overlaps one of the target's that has such an edge.
bool ChartSheet::liesOn(const Chart& target, std::uint32_t k, const std::array<Vec2d, 3>& uv) const {
  bool hit = false;
  visitCells(uv[k], uv[(k + 1) % 3], [&](std::uint64_t key) {
    const auto cell = target.border.find(key);
    if (cell == target.border.end() || hit) return;
    for (const MeshEdge edge : cell->second) {
      const std::array<Vec2d, 3> other = corners(edge.triangle);
      if (doubleArea(other) > 0 && doubleArea(uv) > 0 && trianglesOverlap(uv, other, kOverlapTexels)) hit = true;
    }
  });
  return hit;
}

bool ChartSheet::mayJoin(std::uint32_t into, std::uint32_t from, const Joint& fit, const MergeOptions& options) const {
  const Chart& target = charts_[into];
  const Chart& moved = charts_[from];
  Welded welded{fit.motion, {}};
  for (const MeshEdge edge : fit.matched) {
    const MeshEdge other = beyond(edge);
    welded.places[vertexAt(other.triangle, other.k)] = uvs_[vertexAt(edge.triangle, (edge.k + 1) % 3)];
    welded.places[vertexAt(other.triangle, (other.k + 1) % 3)] = uvs_[vertexAt(edge.triangle, edge.k)];
  }
  if (closesBreak(into, from, welded)) return false;
  Vec2d low = target.low, high = target.high;
  const double maxStretch = options.maxStretch * std::sqrt(smallChartSlack(moved.normals.area));
  std::vector<ChartRim::Edge> rim;
  for (const std::uint32_t t : moved.triangles) {
    std::array<Vec2d, 3> uv;
    bool changed = false;
    for (std::uint32_t k = 0; k < 3; ++k) {
      changed = changed || welded.places.contains(vertexAt(t, k));
      uv[k] = placeOf(t, k, welded);
      low = glm::min(low, uv[k]);
      high = glm::max(high, uv[k]);
    }
    if (changed && !staysGood(t, uv, maxStretch)) return false;
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (joined_[localTriangle_[t]][k]) continue;
      if (liesOn(target, k, uv)) return false;
      const std::array<std::uint32_t, 3> v = mesh_.corners(t);
      rim.push_back({uv[k], uv[(k + 1) % 3], mesh_.points[v[k]], mesh_.points[v[(k + 1) % 3]]});
    }
  }
  if (!packsWell(high - low, target.normals.area + moved.normals.area, options.largestSide)) return false;
  return std::none_of(rim.begin(), rim.end(),
                      [&target](const ChartRim::Edge& edge) { return target.rim.mixesWith(edge); });
}

/// Must run while chartOf still tells the triangles of both charts apart.
void ChartSheet::joinBreaks(std::uint32_t into, std::uint32_t from) {
  std::vector<FrameBreak> kept;
  for (const std::uint32_t chart : {into, from})
    for (const FrameBreak& edge : charts_[chart].breaks) {
      const std::uint32_t other =
          chartOf(edge.cornerA / 3) == chart ? chartOf(edge.cornerB / 3) : chartOf(edge.cornerA / 3);
      if (other != into && other != from) kept.push_back(edge);
    }
  charts_[into].breaks = std::move(kept);
  charts_[from].breaks = {};
}

void ChartSheet::join(std::uint32_t into, std::uint32_t from, const Joint& fit) {
  joinBreaks(into, from);
  Chart& target = charts_[into];
  Chart& moved = charts_[from];
  for (const std::uint32_t v : moved.vertices)
    if (parent_[v] == v) uvs_[v] = fit.motion.apply(uvs_[v]);
  for (const MeshEdge edge : fit.matched) {
    const MeshEdge other = beyond(edge);
    const std::array<std::uint32_t, 2> keep = {vertexAt(edge.triangle, edge.k),
                                               vertexAt(edge.triangle, (edge.k + 1) % 3)};
    const std::array<std::uint32_t, 2> drop = {vertexAt(other.triangle, (other.k + 1) % 3),
                                               vertexAt(other.triangle, other.k)};
    for (std::size_t i = 0; i < 2; ++i)
      if (keep[i] != drop[i]) parent_[drop[i]] = keep[i];
    joined_[localTriangle_[edge.triangle]][edge.k] = true;
    joined_[localTriangle_[other.triangle]][other.k] = true;
    target.perimeter -= 2 * length(edge);
  }
  target.perimeter += moved.perimeter;
  target.normals = NormalMoments(target.normals, moved.normals);
  for (const std::uint32_t t : moved.triangles) {
    chartOf_[localTriangle_[t]] = into;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Vec2d uv = uvs_[vertexAt(t, k)];
      target.low = glm::min(target.low, uv);
      target.high = glm::max(target.high, uv);
      if (!joined_[localTriangle_[t]][k]) insertBorder(target, {t, k});
    }
  }
  target.triangles.insert(target.triangles.end(), moved.triangles.begin(), moved.triangles.end());
  target.vertices.insert(target.vertices.end(), moved.vertices.begin(), moved.vertices.end());
  moved = {};
}

ChartMesh ChartSheet::together(std::uint32_t a, std::uint32_t b, const std::vector<MeshEdge>& shared) const {
  std::vector<std::uint32_t> all = charts_[a].triangles;
  all.insert(all.end(), charts_[b].triangles.begin(), charts_[b].triangles.end());
  std::sort(all.begin(), all.end());
  std::vector<std::int32_t> opposite = joinedSides(all);
  for (const MeshEdge edge : shared) {
    const MeshEdge other = beyond(edge);
    const std::int32_t side = sideIn(all, edge), otherSide = sideIn(all, other);
    opposite[static_cast<std::size_t>(side)] = otherSide;
    opposite[static_cast<std::size_t>(otherSide)] = side;
  }
  return ChartMesh(mesh_, std::move(all), opposite);
}

bool ChartSheet::closesBreak(std::uint32_t a, std::uint32_t b, const FlatChart& flat) const {
  const std::vector<FrameBreak>& breaks = charts_[charts_[a].breaks.size() < charts_[b].breaks.size() ? a : b].breaks;
  return std::any_of(breaks.begin(), breaks.end(), [&](const FrameBreak& edge) { return isClosed(flat, edge); });
}

void ChartSheet::replace(std::uint32_t into, std::uint32_t from, const FlatChart& flat) {
  joinBreaks(into, from);
  std::vector<FrameBreak> breaks = std::move(charts_[into].breaks);
  charts_[from] = {};
  addTriangles(into, flat);
  charts_[into].breaks = std::move(breaks);
  for (const std::uint32_t t : flat.mesh.meshTriangles)
    for (std::uint32_t k = 0; k < 3; ++k)
      if (!joined_[localTriangle_[t]][k]) insertBorder(charts_[into], {t, k});
}

FlatChart ChartSheet::take(std::uint32_t index) const {
  std::vector<std::uint32_t> all = charts_[index].triangles;
  std::sort(all.begin(), all.end());
  const std::vector<std::int32_t> opposite = joinedSides(all);
  FlatChart flat;
  flat.mesh = ChartMesh(mesh_, std::move(all), opposite);
  for (const std::uint32_t corner : flat.mesh.firstCorners())
    flat.uvs.push_back(uvs_[vertexAt(flat.mesh.meshTriangles[corner / 3], corner % 3)]);
  return flat;
}

/// The number of a side (3 * place + k) among ascending triangles of the mesh.
std::int32_t ChartSheet::sideIn(const std::vector<std::uint32_t>& triangles, MeshEdge edge) {
  const auto place = std::lower_bound(triangles.begin(), triangles.end(), edge.triangle);
  return static_cast<std::int32_t>(3 * (place - triangles.begin()) + edge.k);
}

/// Which sides of ascending triangles of one or two charts are joined, as TriangleConnectivity takes them.
std::vector<std::int32_t> ChartSheet::joinedSides(const std::vector<std::uint32_t>& triangles) const {
  std::vector<std::int32_t> opposite;
  for (const std::uint32_t t : triangles)
    for (std::uint32_t k = 0; k < 3; ++k)
      opposite.push_back(joined_[localTriangle_[t]][k] ? sideIn(triangles, beyond({t, k})) : -1);
  return opposite;
}

}  // namespace lumel
