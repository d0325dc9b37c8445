#include "lightmap/charts/chart_mesh.h"

#include <algorithm>
#include <cmath>

#include "lightmap/charts/triangle_overlap.h"

namespace lumel {
namespace {

// A float UV on a page of some thousand texels is known to about 5e-5 texels: flips a good deal thinner are lost there.
constexpr double kFlipTexels = 1e-5;

double cornerArea(const std::array<Vec2d, 3>& t) { return cross2(t[1] - t[0], t[2] - t[0]); }

}  // namespace

ChartMesh::ChartMesh(const HalfEdgeMesh& mesh, std::vector<std::uint32_t> ofMesh,
                     std::span<const std::int32_t> opposite)
    : TriangleConnectivity(opposite), points{{}, mesh.points.toTexels}, meshTriangles(std::move(ofMesh)) {
  points.positions.reserve(vertexCount());
  for (const std::uint32_t corner : firstCorners())
    points.positions.push_back(mesh.points.positions[mesh.corners(meshTriangles[corner / 3])[corner % 3]]);
}

ChartMesh makeChartMesh(const HalfEdgeMesh& mesh, std::vector<std::uint32_t> triangles) {
  std::vector<std::int32_t> opposite(3 * triangles.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle side = mesh.beyond(mesh.side(triangles[t], k));
      if (mesh.isBorder(side)) continue;
      const std::uint32_t other = mesh.triangleOf(side);
      const auto place = std::lower_bound(triangles.begin(), triangles.end(), other);
      if (place != triangles.end() && *place == other)
        opposite[3 * t + k] = static_cast<std::int32_t>(3 * (place - triangles.begin()) + mesh.numberOf(side));
    }
  return ChartMesh(mesh, std::move(triangles), opposite);
}

TriangleSteps stepsFrom(const ChartMesh& chart, std::uint32_t seed) {
  constexpr std::uint32_t kNotReached = 0xffffffffu;
  TriangleSteps steps{std::vector<std::uint32_t>(chart.size(), kNotReached)};
  std::vector<std::uint32_t> queue = {seed};
  steps.distance[seed] = 0;
  for (std::size_t head = 0; head < queue.size(); ++head)
    for (const std::int32_t n : chart.neighbours(queue[head]))
      if (n >= 0 && steps.distance[static_cast<std::size_t>(n)] == kNotReached) {
        steps.distance[static_cast<std::size_t>(n)] = steps.distance[queue[head]] + 1;
        queue.push_back(static_cast<std::uint32_t>(n));
      }
  steps.farthest = queue.back();
  return steps;
}

double shortestHeight(const FlatTriangle& f) {
  return f.x1 * f.y2 / std::max({f.x1, std::hypot(f.x2, f.y2), std::hypot(f.x2 - f.x1, f.y2)});
}

bool isFlipped(const std::array<Vec2d, 3>& uv) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, glm::length(uv[(k + 1) % 3] - uv[k]));
  return !(cornerArea(uv) >= -kFlipTexels * longest);
}

SingularValues singularValues(const FlatTriangle& surface, const std::array<Vec2d, 3>& uv) {
  // Jacobian from the surface to the texture: columns for the surface's x and y.
  const Vec2d jx = (uv[1] - uv[0]) / surface.x1;
  const Vec2d jy = (uv[2] - uv[0] - jx * surface.x2) / surface.y2;
  const double trace = glm::dot(jx, jx) + glm::dot(jy, jy);
  const double det = cross2(jx, jy);
  const double root = std::sqrt(std::max(0.0, trace * trace - 4 * det * det));
  const double big = std::sqrt((trace + root) / 2);
  return {big, big > 0 ? det / big : 0.0};
}

Stretch measureStretch(const ChartMesh& chart, std::span<const Vec2d> uvs, double limit) {
  Stretch result;
  double total = 0, bad = 0, squares = 0;
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const FlatTriangle flat = layFlat(chart, t);
    const std::array<std::uint32_t, 3> v = chart.corners(t);
    const std::array<Vec2d, 3> uv = {uvs[v[0]], uvs[v[1]], uvs[v[2]]};
    const double area = flat.x1 * flat.y2;
    total += area;
    if (!(cornerArea(uv) > 0)) {
      if (isFlipped(uv) || shortestHeight(flat) > kNegligibleTexels) ++result.flipped;
      bad += area;
      continue;
    }
    const SingularValues values = singularValues(flat, uv);
    if (!values.within(limit)) bad += area;
    squares += area * std::min(0.5 * (1 / (values.big * values.big) + 1 / (values.small * values.small)), 1e3);
  }
  result.badShare = bad / total;
  result.l2 = std::sqrt(squares / total);
  return result;
}

double surfaceArea(const ChartMesh& chart) {
  double area = 0;
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const FlatTriangle flat = layFlat(chart, t);
    area += 0.5 * flat.x1 * flat.y2;
  }
  return area;
}

void scaleToSurface(const ChartMesh& chart, std::vector<Vec2d>& uvs) {
  double surface = 0, texture = 0;
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const FlatTriangle flat = layFlat(chart, t);
    const std::array<std::uint32_t, 3> v = chart.corners(t);
    surface += flat.x1 * flat.y2;
    texture += std::abs(cross2(uvs[v[1]] - uvs[v[0]], uvs[v[2]] - uvs[v[0]]));
  }
  if (!(texture > 0)) return;
  const double scale = std::sqrt(surface / texture);
  for (Vec2d& uv : uvs) uv *= scale;
}

namespace {

/// Convex hull (Andrew 1979), counter-clockwise.
std::vector<Vec2d> convexHull(std::vector<Vec2d> points) {
  std::sort(points.begin(), points.end(), [](Vec2d a, Vec2d b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  std::vector<Vec2d> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t base = hull.size();
    for (const Vec2d p : points) {
      while (hull.size() >= base + 2 && cross2(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// Direction of the smallest enclosing rectangle: it has an edge of the hull on it (Freeman and Shapira 1975).
Vec2d smallestRectangle(const std::vector<Vec2d>& hull) {
  Vec2d best{1, 0};
  double bestArea = std::numeric_limits<double>::infinity();
  // A hull of very many points is nearly round: some of its edges do.
  const std::size_t step = 1 + hull.size() / 128;
  for (std::size_t i = 0; i < hull.size(); i += step) {
    const Vec2d edge = hull[(i + 1) % hull.size()] - hull[i];
    const double length = glm::length(edge);
    if (!(length > 0)) continue;
    const Vec2d d = edge / length;
    Vec2d low(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec2d p : hull) {
      const Vec2d q(glm::dot(d, p), cross2(d, p));
      low = glm::min(low, q);
      high = glm::max(high, q);
    }
    const double area = (high.x - low.x) * (high.y - low.y);
    if (area < bestArea * (1 - 1e-9)) {
      bestArea = area;
      best = d;
    }
  }
  return best;
}

/// The direction (modulo quarter turns) of most of the border's length; share of the border within half a degree.
Vec2d dominantDirection(const ChartMesh& chart, std::span<const Vec2d> uvs, double& share) {
  constexpr int kBins = 180;  // half a degree each
  std::array<double, kBins> length{};
  std::array<double, kBins> longest{};
  std::array<Vec2d, kBins> direction{};
  double total = 0;
  for (std::size_t t = 0; t < chart.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle side = chart.side(t, k);
      if (!chart.isBorder(chart.beyond(side))) continue;
      const Vec2d edge = uvs[chart.endOf(side)] - uvs[chart.startOf(side)];
      const double size = glm::length(edge);
      if (!(size > 0)) continue;
      const double quarter = std::atan2(edge.y, edge.x) / (std::numbers::pi / 2) + 4;
      const int bin = static_cast<int>(std::lround((quarter - std::floor(quarter)) * kBins)) % kBins;
      length[static_cast<std::size_t>(bin)] += size;
      total += size;
      if (size > longest[static_cast<std::size_t>(bin)]) {
        longest[static_cast<std::size_t>(bin)] = size;
        direction[static_cast<std::size_t>(bin)] = edge / size;
      }
    }
  const auto best = static_cast<std::size_t>(std::max_element(length.begin(), length.end()) - length.begin());
  const double around = length[best] + length[(best + 1) % kBins] + length[(best + kBins - 1) % kBins];
  share = total > 0 ? around / total : 0.0;
  return direction[best];
}

}  // namespace

void alignToAxes(const ChartMesh& chart, std::vector<Vec2d>& uvs) {
  constexpr double kDominantShare = 0.3;
  double share = 0;
  Vec2d axis = dominantDirection(chart, uvs, share);
  if (share < kDominantShare) axis = smallestRectangle(convexHull({uvs.begin(), uvs.end()}));
  for (Vec2d& uv : uvs) uv = Vec2d(glm::dot(axis, uv), cross2(axis, uv));
}

namespace {

/// Triangles of a flattened chart in square cells, for pairs that may meet.
///
/// Of slivers every one meets most others of its cells, so what is known without a look at pairs is used: the triangles
/// around one vertex lie apart if none is turned over and their angles add up to a turn at most. Those of vertices
/// where many meet (hubs: caps of cylinders) are not compared with each other. Cells with many others are swept across
/// their triangles' common direction, by which long parallel ones come apart.
class OverlapGrid {
 public:
  OverlapGrid(const ChartMesh& chart, std::span<const Vec2d> uvs) : chart_(chart), uvs_(uvs) {
    low_ = Vec2d(std::numeric_limits<double>::infinity());
    Vec2d high = -low_;
    for (const Vec2d uv : uvs) {
      low_ = glm::min(low_, uv);
      high = glm::max(high, uv);
    }
    const Vec2d size = glm::max(high - low_, Vec2d(1e-9));
    // About one triangle per cell; long thin charts still get square cells. Slivers lie in kMostCells on average.
    double longest = 0;
    for (std::uint32_t t = 0; t < chart.size(); ++t) longest += glm::length(longestEdge(t));
    const auto count = static_cast<double>(chart.size());
    cell_ =
        std::max({std::sqrt(size.x * size.y / count), std::max(size.x, size.y) / 4096, longest / (count * kMostCells)});
    width_ = static_cast<std::size_t>(size.x / cell_) + 1;
    height_ = static_cast<std::size_t>(size.y / cell_) + 1;
    findHubs();
    fill();
  }

  bool anyOverlap() {
    for (std::size_t cell = 0; cell + 1 < start_.size(); ++cell) {
      const std::span<std::uint32_t> here(entries_.data() + start_[cell], start_[cell + 1] - start_[cell]);
      if (here.size() > kCrowd ? anyInCrowd(here) : anyOfPairs(here, here)) return true;
    }
    return false;
  }

 private:
  static constexpr double kMostCells = 16;
  static constexpr std::size_t kCrowd = 64;
  static constexpr std::size_t kHub = 16;  // triangles around a hub, at least
  static constexpr std::uint32_t kNoHub = 0xffffffffu;

  Vec2d longestEdge(std::uint32_t t) const {
    const std::array<Vec2d, 3> p = corners(t);
    const std::array<Vec2d, 3> edges = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
    return *std::ranges::max_element(edges, {}, [](const Vec2d& e) { return glm::dot(e, e); });
  }

  bool meet(std::uint32_t s, std::uint32_t t) const {
    if (hub_[s] != kNoHub && hub_[s] == hub_[t]) return false;
    // Two layers cannot lie on each other without the border of one of them doing so.
    return (onBorder_[s] || onBorder_[t]) && overlap(s, t);
  }

  /// Every pair once where both are the same.
  bool anyOfPairs(std::span<const std::uint32_t> some, std::span<const std::uint32_t> others) const {
    for (std::size_t i = 0; i < some.size(); ++i)
      for (std::size_t j = 0; j < (some.data() == others.data() ? i : others.size()); ++j)
        if (meet(some[i], others[j])) return true;
    return false;
  }

  bool anyInCrowd(std::span<std::uint32_t> here) const {
    std::ranges::sort(here, {}, [this](std::uint32_t t) { return hub_[t]; });
    // Where more than half belong to one hub it is that of the middle.
    const std::uint32_t hub = hub_[here[here.size() / 2]];
    const auto [first, last] = std::ranges::equal_range(here, hub, {}, [this](std::uint32_t t) { return hub_[t]; });
    const std::span<const std::uint32_t> before(here.begin(), first), of(first, last), after(last, here.end());
    if (hub == kNoHub || 2 * of.size() < here.size()) return anyBySweep(here);
    return anyOfPairs(before, of) || anyOfPairs(after, of) || anyOfPairs(before, after) || anyOfPairs(before, before) ||
           anyOfPairs(after, after);
  }

  bool anyBySweep(std::span<const std::uint32_t> here) const {
    // Directions are the same when turned by half a turn, so their double angles are added.
    Vec2d doubled(0);
    for (const std::uint32_t t : here) {
      const Vec2d e = longestEdge(t);
      const double length = glm::length(e);
      if (length > 0) doubled += Vec2d(e.x * e.x - e.y * e.y, 2 * e.x * e.y) / length;
    }
    const double angle = 0.5 * std::atan2(doubled.y, doubled.x);
    const Vec2d across(-std::sin(angle), std::cos(angle));
    struct Interval {
      double low, high;
      std::uint32_t triangle;
    };
    std::vector<Interval> intervals;
    for (const std::uint32_t t : here) {
      const std::array<Vec2d, 3> p = corners(t);
      const auto [low, high] = std::minmax({glm::dot(across, p[0]), glm::dot(across, p[1]), glm::dot(across, p[2])});
      intervals.push_back({low, high, t});
    }
    std::ranges::sort(intervals, [](const Interval& a, const Interval& b) {
      return a.low < b.low || (a.low == b.low && a.triangle < b.triangle);
    });
    for (std::size_t i = 0; i < intervals.size(); ++i)
      for (std::size_t j = i + 1; j < intervals.size() && intervals[j].low < intervals[i].high; ++j)
        if (meet(intervals[i].triangle, intervals[j].triangle)) return true;
    return false;
  }

  /// A triangle belongs to the one of its vertices where most meet, if these are known to lie apart.
  void findHubs() {
    std::vector<std::uint32_t> valence(uvs_.size(), 0);
    std::vector<double> turn(uvs_.size(), 0.0);
    const auto count = static_cast<std::uint32_t>(chart_.size());
    for (std::uint32_t t = 0; t < count; ++t) {
      const std::array<Vec2d, 3> p = corners(t);
      const std::array<std::uint32_t, 3> v = chart_.corners(t);
      const bool isTurned = !(cornerArea(p) > 0);
      for (std::size_t k = 0; k < 3; ++k) {
        ++valence[v[k]];
        const Vec2d a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
        turn[v[k]] += isTurned ? std::numeric_limits<double>::infinity() : std::atan2(cross2(a, b), glm::dot(a, b));
      }
    }
    constexpr double kFullTurn = 2 * std::numbers::pi * (1 + 1e-9);  // angles of a whole umbrella are rounded
    hub_.assign(count, kNoHub);
    for (std::uint32_t t = 0; t < count; ++t) {
      std::uint32_t most = kHub - 1;
      for (const std::uint32_t v : chart_.corners(t))
        if (valence[v] > most && turn[v] <= kFullTurn) {
          most = valence[v];
          hub_[t] = v;
        }
    }
  }

  std::array<Vec2d, 3> corners(std::uint32_t t) const {
    const std::array<std::uint32_t, 3> v = chart_.corners(t);
    return {uvs_[v[0]], uvs_[v[1]], uvs_[v[2]]};
  }

  template <class Visit>
  void visitCells(std::uint32_t t, Visit visit) const {
    const std::array<Vec2d, 3> p = corners(t);
    const double top = std::min({p[0].y, p[1].y, p[2].y});
    const double bottom = std::max({p[0].y, p[1].y, p[2].y});
    const auto row = [this](double y) {
      return std::min(height_ - 1, static_cast<std::size_t>(std::max(0.0, (y - low_.y) / cell_)));
    };
    for (std::size_t y = row(top); y <= row(bottom); ++y) {
      const double y0 = low_.y + static_cast<double>(y) * cell_;
      const double y1 = y0 + cell_;
      double left = std::numeric_limits<double>::infinity(), right = -left;
      for (std::size_t k = 0; k < 3; ++k) {  // the band's part of each edge
        const Vec2d a = p[k];
        const Vec2d b = p[(k + 1) % 3];
        if (std::max(a.y, b.y) < y0 || std::min(a.y, b.y) > y1) continue;
        const double dy = b.y - a.y;
        for (const double at : {y0, y1}) {
          const double s = dy == 0 ? 0.0 : std::clamp((at - a.y) / dy, 0.0, 1.0);
          const double x = a.x + s * (b.x - a.x);
          left = std::min(left, dy == 0 ? std::min(a.x, b.x) : x);
          right = std::max(right, dy == 0 ? std::max(a.x, b.x) : x);
        }
      }
      if (left > right) continue;
      const auto column = [this](double x) {
        return std::min(width_ - 1, static_cast<std::size_t>(std::max(0.0, (x - low_.x) / cell_)));
      };
      for (std::size_t x = column(left); x <= column(right); ++x) visit(y * width_ + x);
    }
  }

  void fill() {
    const auto count = static_cast<std::uint32_t>(chart_.size());
    onBorder_.resize(count);
    start_.assign(width_ * height_ + 1, 0);
    for (std::uint32_t t = 0; t < count; ++t) {
      const std::array<std::int32_t, 3> n = chart_.neighbours(t);
      onBorder_[t] = n[0] < 0 || n[1] < 0 || n[2] < 0;
      visitCells(t, [this](std::size_t cell) { ++start_[cell + 1]; });
    }
    for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
    entries_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::uint32_t t = 0; t < count; ++t) visitCells(t, [&](std::size_t cell) { entries_[next[cell]++] = t; });
  }

  /// Separating axes: along every edge's normal the triangles must come apart up to kOverlapTexels.
  bool overlap(std::uint32_t s, std::uint32_t t) const {
    const std::array<Vec2d, 3> a = corners(s);
    const std::array<Vec2d, 3> b = corners(t);
    if (!(cornerArea(a) > 0) || !(cornerArea(b) > 0)) return false;  // no area to lie on anything
    return trianglesOverlap(a, b, kOverlapTexels);
  }

  const ChartMesh& chart_;
  std::span<const Vec2d> uvs_;
  Vec2d low_;
  double cell_ = 1;
  std::size_t width_ = 1, height_ = 1;
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> entries_;
  std::vector<bool> onBorder_;
  std::vector<std::uint32_t> hub_;  // per triangle: a vertex, or kNoHub
};

}  // namespace

bool packsWell(Vec2d size, double area, double largestSide) {
  constexpr double kLargeShare = 0.05;  // of the page, by the box
  constexpr double kEmptyShare = 0.3;   // of the box
  if (std::max(size.x, size.y) > largestSide) return false;
  const double box = size.x * size.y;
  return box < kLargeShare * largestSide * largestSide || area > kEmptyShare * box;
}

bool packsWell(std::span<const Vec2d> uvs, double area, double largestSide) {
  Vec2d low = uvs[0], high = uvs[0];
  for (const Vec2d uv : uvs) {
    low = glm::min(low, uv);
    high = glm::max(high, uv);
  }
  return packsWell(high - low, area, largestSide);
}

bool overlapsItself(const ChartMesh& chart, std::span<const Vec2d> uvs) {
  return chart.size() > 1 && OverlapGrid(chart, uvs).anyOverlap();
}

}  // namespace lumel
