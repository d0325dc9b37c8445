#include "lightmap/charts/unwrap.h"

#include <algorithm>

#include "lightmap/charts/chart_cut.h"
#include "lightmap/charts/chart_growing.h"
#include "lightmap/charts/chart_merging.h"
#include "lightmap/charts/flatten.h"
#include "lightmap/charts/frame_slits.h"
#include "lightmap/charts/half_edge_mesh.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Two connected halves: what is nearer to one end of the chart than to the other.
std::array<std::vector<std::uint32_t>, 2> halve(const ChartMesh& chart) {
  const TriangleSteps fromOne = stepsFrom(chart, stepsFrom(chart, 0).farthest);
  const TriangleSteps fromOther = stepsFrom(chart, fromOne.farthest);
  std::array<std::vector<std::uint32_t>, 2> halves;
  for (std::uint32_t t = 0; t < chart.size(); ++t)
    halves[fromOne.distance[t] <= fromOther.distance[t] ? 0 : 1].push_back(chart.meshTriangles[t]);
  return halves;
}

struct Box {
  Vec2d low{std::numeric_limits<double>::infinity()};
  Vec2d high{-std::numeric_limits<double>::infinity()};
  double side() const { return std::max(high.x - low.x, high.y - low.y); }
};

Box boxOf(const std::vector<Vec2d>& uvs) {
  Box box;
  for (const Vec2d uv : uvs) {
    box.low = glm::min(box.low, uv);
    box.high = glm::max(box.high, uv);
  }
  return box;
}

/// Straightens a chart, unless that would make it too long for the page, and moves it to the origin.
UnwrappedChart finish(const HalfEdgeMesh& mesh, FlatChart& flat, double largestSide) {
  std::vector<Vec2d> aligned = flat.uvs;
  alignToAxes(flat.mesh, aligned);
  if (boxOf(aligned).side() > largestSide) aligned = std::move(flat.uvs);
  const Vec2d low = boxOf(aligned).low;
  UnwrappedChart chart;
  for (const Vec2d uv : aligned) chart.uvs.push_back(Vec2(uv - low));
  for (const std::uint32_t t : flat.mesh.meshTriangles) chart.triangles.push_back(mesh.sourceOf(t));
  for (std::size_t t = 0; t < flat.mesh.size(); ++t) chart.corners.push_back(flat.mesh.corners(t));
  flat = {};
  return chart;
}

class Unwrapper {
 public:
  Unwrapper(const HalfEdgeMesh& mesh, const MergeTree& tree, const UnwrapOptions& options)
      : mesh_(mesh), tree_(tree), options_(options) {}

  /// Flattens a region, or what it is made of where that fails.
  std::vector<FlatChart> region(std::uint32_t root) const {
    std::vector<FlatChart> charts;
    flattenNode(root, charts);
    return charts;
  }

 private:
  bool tryFlatten(std::vector<std::uint32_t> triangles, FlatChart& chart) const {
    chart.mesh = makeChartMesh(mesh_, std::move(triangles));
    const ChartForm form = formOf(chart.mesh);
    if (form == ChartForm::Closed) return false;
    if (form == ChartForm::Band) cutBand(mesh_, chart.mesh);
    Flattening flat = flatten(chart.mesh, {options_.maxStretch, options_.largestSide});
    chart.uvs = std::move(flat.uvs);
    return flat.valid;
  }

  void flattenNode(std::uint32_t node, std::vector<FlatChart>& charts) const {
    FlatChart chart;
    if (tryFlatten(tree_.trianglesBelow(node), chart) || tree_.isLeaf(node)) {
      charts.push_back(std::move(chart));
      return;
    }
    // The last merge is undone if that splits the chart fairly; a tree that grew triangle by triangle would take as
    // many steps, so there it is halved.
    constexpr double kFairShare = 0.15;
    const auto& children = tree_.children(node);
    const double all = static_cast<double>(chart.mesh.size());
    const double share = static_cast<double>(tree_.trianglesBelow(children[0]).size()) / all;
    if (std::min(share, 1 - share) >= kFairShare) {
      flattenBoth(charts, [&](std::size_t i, std::vector<FlatChart>& found) { flattenNode(children[i], found); });
    } else {
      flattenHalves(chart.mesh, charts);
    }
  }

  void flattenHalves(const ChartMesh& whole, std::vector<FlatChart>& charts) const {
    std::array<std::vector<std::uint32_t>, 2> halves = halve(whole);
    flattenBoth(charts, [&](std::size_t i, std::vector<FlatChart>& found) {
      const bool single = halves[i].size() == 1;
      FlatChart chart;
      if (tryFlatten(std::move(halves[i]), chart) || single)
        found.push_back(std::move(chart));
      else
        flattenHalves(chart.mesh, found);
    });
  }

  /// Calls part(0, charts) and part(1, charts) side by side: a large region that falls apart would hold up all others.
  template <class Part>
  static void flattenBoth(std::vector<FlatChart>& charts, Part part) {
    std::array<std::vector<FlatChart>, 2> found;
    parallelFor(2, 1, [&](std::size_t i, std::size_t) { part(i, found[i]); });
    for (std::vector<FlatChart>& half : found)
      for (FlatChart& chart : half) charts.push_back(std::move(chart));
  }

  const HalfEdgeMesh& mesh_;
  const MergeTree& tree_;
  const UnwrapOptions& options_;
};

}  // namespace

Unwrapped unwrap(TriangleSoup&& soup, const UnwrapOptions& options) {
  const HalfEdgeMesh mesh = buildHalfEdgeMesh(std::move(soup));
  GrowOptions growOptions;
  growOptions.largestSide = options.largestSide;
  const MergeTree tree = growCharts(mesh, growOptions);
  const Unwrapper unwrapper(mesh, tree, options);
  std::vector<std::vector<FlatChart>> perRegion(tree.roots.size());
  parallelFor(tree.roots.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) perRegion[i] = unwrapper.region(tree.roots[i]);
  });

  std::vector<FlatChart> charts;
  for (std::vector<FlatChart>& region : perRegion)
    for (FlatChart& flat : region) charts.push_back(std::move(flat));
  charts = splitAtFrameSlits(mesh, std::move(charts));
  charts = mergeCharts(mesh, std::move(charts), {options.maxStretch, options.largestSide});
  charts = splitAtFrameSlits(mesh, std::move(charts));

  Unwrapped result;
  result.degenerateTriangles = mesh.leftOut.size();
  result.nonManifoldEdges = mesh.nonManifoldEdges;
  result.charts.resize(charts.size());
  constexpr std::size_t kGrain = 64;
  parallelFor(charts.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) result.charts[i] = finish(mesh, charts[i], options.largestSide);
  });
  std::stable_sort(result.charts.begin(), result.charts.end(), [](const UnwrappedChart& a, const UnwrappedChart& b) {
    return a.triangles.front() < b.triangles.front();
  });
  return result;
}

}  // namespace lumel
