#include "lightmap/charts/chart_merging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "lightmap/charts/border_graph.h"
#include "lightmap/charts/chart_growing.h"
#include "lightmap/charts/chart_sheet.h"
#include "lightmap/charts/flatten.h"
#include "lightmap/charts/frame_slits.h"
#include "scene/base/parallel.h"
#include "scene/base/union_find.h"

namespace lumel {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Border {
  std::vector<MeshEdge> edges;  // from the side of either chart
  double length = 0, crease = 0;
  double refusedArea = 0;  // of both charts together when flattening them as one failed

  void absorb(Border& other) {
    edges.insert(edges.end(), other.edges.begin(), other.edges.end());
    length += other.length;
    crease += other.crease;
    other.edges = {};
  }
};

/// How sharply two charts may meet (1 - cos), by the smaller one's size: what is too small to show a difference in
/// light had better share texels than be alone in a texel with a gutter around it.
double creaseLimit(double area, double perimeter) {
  const double width = 2 * area / perimeter;
  if (area < kTinyTexels || width < 0.75) return 1.2;  // just over a right angle
  if (width < 1.5) return 1.05;
  if (area < 16) return 0.75;  // 75 degrees
  return 0.5;                  // 60 degrees
}

class PartMerger {
 public:
  PartMerger(const HalfEdgeMesh& mesh, std::vector<FlatChart*> charts, const std::vector<std::uint32_t>& localTriangle,
             const std::vector<FrameBreak>& breaks, const MergeOptions& options)
      : mesh_(mesh),
        options_(options),
        charts_(std::move(charts)),
        sheet_(mesh, charts_, localTriangle, breaks),
        borders_(charts_.size()) {}

  std::vector<FlatChart> run() {
    makeBorders();
    const auto costOf = [this](std::uint32_t border) { return cost(border); };
    queue_.fill(borders_, costOf);
    queue_.run(borders_, costOf, [this](std::uint32_t border) { tryMerge(border); });
    return collect();
  }

 private:
  void makeBorders() {
    members_.resize(charts_.size());
    for (std::uint32_t c = 0; c < charts_.size(); ++c) {
      members_[c] = {c};
      const ChartMesh& chart = charts_[c]->mesh;
      for (const std::uint32_t t : chart.meshTriangles)
        for (std::uint32_t k = 0; k < 3; ++k)
          if (mesh_.neighbour(t, k) >= 0) addSide(c, {t, k});
    }
  }

  void addSide(std::uint32_t c, MeshEdge edge) {
    const auto other = static_cast<std::uint32_t>(mesh_.neighbour(edge.triangle, edge.k));
    const std::uint32_t d = sheet_.chartOf(other);
    if (d <= c) return;  // a cut inside a chart, or met from the other side
    Border& border = borders_[borders_.between(c, d)];
    border.edges.push_back(edge);
    const Vec3d n = areaNormal(mesh_, edge.triangle);
    const Vec3d m = areaNormal(mesh_, other);
    const double bend = 1 - glm::dot(n, m) / (glm::length(n) * glm::length(m));
    const double length = sheet_.length(edge);
    border.length += length;
    border.crease += length * std::max(0.0, bend) * (mesh_.isHard(edge.triangle, edge.k) ? 1.0 : kSmoothCrease);
  }

  double cost(std::uint32_t index) const {
    const Border& border = borders_[index];
    const ChartSheet::Chart& a = sheet_.chart(borders_.ends(index)[0]);
    const ChartSheet::Chart& b = sheet_.chart(borders_.ends(index)[1]);
    const ChartSheet::Chart& smaller = a.normals.area < b.normals.area ? a : b;
    const double crease = border.crease / border.length;
    if (crease > creaseLimit(smaller.normals.area, smaller.perimeter)) return kNever;
    return withoutNoise(crease + 0.5 * std::max(0.0, 1 - 2 * border.length / smaller.perimeter));
  }

  void tryMerge(std::uint32_t index) {
    Border& border = borders_[index];
    auto [into, from] = borders_.ends(index);
    if (sheet_.chart(into).triangles.size() < sheet_.chart(from).triangles.size()) std::swap(into, from);
    std::vector<MeshEdge> shared;
    for (const MeshEdge edge : border.edges)
      shared.push_back(sheet_.chartOf(edge.triangle) == into ? edge : sheet_.beyond(edge));
    // A long common border first; what meets by little of it only where no flattening of both does better.
    constexpr double kMuch = 0.25, kLittle = 0.12;  // of the border: half a pipe meets the other half along one of two
    if (moveTo(border, into, from, shared, kMuch) || flattenAsOne(border, into, from, shared) ||
        moveTo(border, into, from, shared, kLittle))
      merged(into, from);
  }

  /// Joins the charts as they are, by a rigid motion that lets at least a share of the border meet.
  bool moveTo(const Border& border, std::uint32_t into, std::uint32_t from, const std::vector<MeshEdge>& shared,
              double leastMatch) {
    const double smaller = std::min(sheet_.chart(into).normals.area, sheet_.chart(from).normals.area);
    for (const Joint& fit : sheet_.fits(shared, smallChartSlack(smaller))) {
      // What is too small for a chart of its own may hang on by any edge.
      if (smaller >= kTinyTexels && fit.length < leastMatch * border.length) return false;
      if (!sheet_.mayJoin(into, from, fit, options_)) continue;
      sheet_.join(into, from, fit);
      return true;
    }
    return false;
  }

  /// Flattens both anew as one chart: for curved surfaces, whose borders do not meet rigidly.
  bool flattenAsOne(Border& border, std::uint32_t into, std::uint32_t from, const std::vector<MeshEdge>& shared) {
    constexpr std::size_t kMostTriangles = 4000;  // keeps the number of flattenings times their cost near linear
    constexpr double kMostConeVariance = 0.12;    // not worth the attempt
    constexpr double kLeastBorder = 0.1;          // of the smaller one's perimeter: no chart with a narrow waist
    constexpr double kGrowth = 1.3;               // since the last attempt
    const ChartSheet::Chart& a = sheet_.chart(into);
    const ChartSheet::Chart& b = sheet_.chart(from);
    if (a.triangles.size() + b.triangles.size() > kMostTriangles) return false;
    const NormalMoments both(a.normals, b.normals);
    if (both.area < kGrowth * border.refusedArea) return false;
    if (border.length < kLeastBorder * std::min(a.perimeter, b.perimeter)) return false;
    border.refusedArea = both.area;
    if (both.coneVariance() > kMostConeVariance * smallChartSlack(both.area)) return false;
    FlatChart flat;
    flat.mesh = sheet_.together(into, from, shared);
    Flattening flattened = flatten(flat.mesh, {options_.maxStretch, options_.largestSide});
    if (!flattened.valid) return false;
    flat.uvs = std::move(flattened.uvs);
    if (sheet_.closesBreak(into, from, flat)) return false;
    sheet_.replace(into, from, flat);
    return true;
  }

  void merged(std::uint32_t into, std::uint32_t from) {
    members_[into].insert(members_[into].end(), members_[from].begin(), members_[from].end());
    members_[from].clear();
    borders_.merge(from, into, [](std::uint32_t) {});
    // What was refused may fit the grown chart.
    borders_.forEachOf(
        into, [this](std::uint32_t border) { queue_.push(border, [this](std::uint32_t b) { return cost(b); }); });
  }

  std::vector<FlatChart> collect() {
    std::vector<FlatChart> result;
    for (std::uint32_t c = 0; c < charts_.size(); ++c) {
      if (members_[c].empty()) continue;
      if (members_[c].size() == 1) {
        result.push_back(std::move(*charts_[c]));
        continue;
      }
      FlatChart merged = sheet_.take(c);
      // The border test does not see everything (slivers along a border): what fails in full stays apart.
      if (!overlapsItself(merged.mesh, merged.uvs)) {
        result.push_back(std::move(merged));
      } else {
        for (const std::uint32_t member : members_[c]) result.push_back(std::move(*charts_[member]));
      }
    }
    return result;
  }

  const HalfEdgeMesh& mesh_;
  const MergeOptions& options_;
  std::vector<FlatChart*> charts_;
  ChartSheet sheet_;
  BorderGraph<Border> borders_;
  std::vector<std::vector<std::uint32_t>> members_;  // per chart: the charts that it is made of
  BorderQueue queue_;
};

}  // namespace

std::vector<FlatChart> mergeCharts(const HalfEdgeMesh& mesh, std::vector<FlatChart> charts,
                                   const MergeOptions& options) {
  std::vector<std::uint32_t> chartOf(mesh.size(), 0);
  for (std::uint32_t c = 0; c < charts.size(); ++c)
    for (const std::uint32_t t : charts[c].mesh.meshTriangles) chartOf[t] = c;
  std::vector<std::uint32_t> parent(charts.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::uint32_t t = 0; t < mesh.size(); ++t)
    for (const std::int32_t n : mesh.neighbours(t)) {
      if (n >= 0) unite(parent, chartOf[t], chartOf[static_cast<std::size_t>(n)]);
    }
  std::vector<std::vector<FlatChart*>> parts;
  std::vector<std::uint32_t> partOf(charts.size(), 0);
  std::vector<std::uint32_t> localTriangle(mesh.size(), 0);
  std::vector<std::uint32_t> partTriangles;
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    const std::uint32_t root = findRoot(parent, c);
    if (root == c) {
      partOf[c] = static_cast<std::uint32_t>(parts.size());
      parts.emplace_back();
      partTriangles.push_back(0);
    }
    const std::uint32_t part = partOf[root];
    parts[part].push_back(&charts[c]);
    for (const std::uint32_t t : charts[c].mesh.meshTriangles) localTriangle[t] = partTriangles[part]++;
  }
  std::vector<std::vector<FrameBreak>> breaks(parts.size());
  for (const FrameBreak& edge : mesh.frameBreaks) {
    const std::uint32_t part = partOf[findRoot(parent, chartOf[edge.cornerA / 3])];
    if (part == partOf[findRoot(parent, chartOf[edge.cornerB / 3])]) breaks[part].push_back(edge);
  }
  std::vector<std::vector<FlatChart>> merged(parts.size());
  parallelFor(parts.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (parts[i].size() == 1)
        merged[i].push_back(std::move(*parts[i][0]));
      else
        merged[i] = PartMerger(mesh, parts[i], localTriangle, breaks[i], options).run();
    }
  });
  std::vector<FlatChart> result;
  for (std::vector<FlatChart>& part : merged)
    for (FlatChart& chart : part) result.push_back(std::move(chart));
  return result;
}

}  // namespace lumel
