#include "lightmap/charts/chart_growing.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "lightmap/charts/border_graph.h"
#include "lightmap/charts/chart_mesh.h"

namespace lumel {
namespace {

constexpr double kCreaseFadeTexels = 0.5;  // creases of thinner triangles count less: no texel could show them
constexpr double kMostCrease = 1.2;        // however small: a little over a right angle
constexpr double kShapeWeight = 0.002;     // against ragged borders: only decides between merges that are flat alike

struct Region {
  NormalMoments normals;
  double perimeter = 0.0;
  Vec3 low{0.0f}, high{0.0f};
  std::uint32_t node = 0;
};

struct Border {
  float length = 0.0f;
  float crease = 0.0f;  // length * (1 - cos of the bend)

  void absorb(const Border& other) {
    length += other.length;
    crease += other.crease;
  }
};

/// Smallest eigenvalue of a symmetric 3x3 matrix (xx yy zz xy xz yz), by the trigonometric formula.
double smallestEigenvalue(const std::array<double, 6>& m) {
  const double mean = (m[0] + m[1] + m[2]) / 3;
  const double a = m[0] - mean;
  const double b = m[1] - mean;
  const double c = m[2] - mean;
  const double offDiagonal = m[3] * m[3] + m[4] * m[4] + m[5] * m[5];
  const double p = std::sqrt((a * a + b * b + c * c + 2 * offDiagonal) / 6);
  if (!(p > 1e-14)) return mean;
  const double determinant =
      a * (b * c - m[5] * m[5]) - m[3] * (m[3] * c - m[5] * m[4]) + m[4] * (m[3] * m[5] - b * m[4]);
  const double r = std::clamp(determinant / (2 * p * p * p), -1.0, 1.0);
  return mean + 2 * p * std::cos(std::acos(r) / 3 + 2 * std::numbers::pi / 3);
}

class Grower {
 public:
  Grower(const HalfEdgeMesh& mesh, const GrowOptions& options)
      : mesh_(mesh),
        options_(options),
        points_(mesh.points.all()),
        place_(mesh.size(), kSingle),
        borders_(mesh.size(), 3 * mesh.size() / 2) {}

  MergeTree grow() {
    tree_.triangleCount = mesh_.size();
    tree_.merges.reserve(mesh_.size());
    makeBorders();
    const auto costOf = [this](std::uint32_t border) { return cost(border); };
    queue_.fill(borders_, costOf);
    queue_.run(borders_, costOf, [this](std::uint32_t border) { merge(border); });
    collectRoots();
    return std::move(tree_);
  }

 private:
  /// Where a region's figures are kept. Those of single triangles and of pairs, which is what there is most of, are
  /// made anew each time: kept, they would take half of the memory of growing. A pair is known by its merge.
  static constexpr std::uint32_t kSingle = 0xffffffffu;
  static constexpr std::uint32_t kPair = 0x80000000u;

  bool isKept(std::uint32_t index) const { return place_[index] < kPair; }

  Region regionOf(std::uint32_t index) const {
    if (isKept(index)) return kept_[place_[index]];
    if (place_[index] == kSingle) return single(index);
    const std::uint32_t merge = place_[index] - kPair;
    const auto [t, u] = tree_.merges[merge];
    Region pair = united(single(t), single(u), lengthBetween(t, u));
    pair.node = static_cast<std::uint32_t>(tree_.triangleCount + merge);
    return pair;
  }

  static Region united(Region a, const Region& b, float commonLength) {
    a.perimeter += b.perimeter - 2 * static_cast<double>(commonLength);
    a.normals = NormalMoments(a.normals, b.normals);
    a.low = glm::min(a.low, b.low);
    a.high = glm::max(a.high, b.high);
    return a;
  }

  /// Twice the triangle's area long.
  Vec3d normalOf(std::uint32_t triangle) const {
    const std::array<std::uint32_t, 3> v = mesh_.corners(triangle);
    return glm::cross(points_[v[1]] - points_[v[0]], points_[v[2]] - points_[v[0]]);
  }

  double edgeLength(std::uint32_t triangle, std::size_t k) const {
    const std::array<std::uint32_t, 3> v = mesh_.corners(triangle);
    return glm::length(points_[v[(k + 1) % 3]] - points_[v[k]]);
  }

  /// The length that the border of two triangles holds.
  float lengthBetween(std::uint32_t t, std::uint32_t u) const {
    float length = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (mesh_.neighbour(std::min(t, u), k) == static_cast<std::int32_t>(std::max(t, u)))
        length += static_cast<float>(edgeLength(std::min(t, u), k));
    return length;
  }

  Region single(std::uint32_t triangle) const {
    Region r;
    r.normals = NormalMoments(normalOf(triangle));
    const std::array<std::uint32_t, 3> v = mesh_.corners(triangle);
    r.low = Vec3(glm::min(points_[v[0]], glm::min(points_[v[1]], points_[v[2]])));
    r.high = Vec3(glm::max(points_[v[0]], glm::max(points_[v[1]], points_[v[2]])));
    for (std::size_t k = 0; k < 3; ++k) r.perimeter += edgeLength(triangle, k);
    r.node = triangle;
    return r;
  }

  void keep(std::uint32_t index, const Region& region) {
    if (!isKept(index)) {
      if (free_.empty()) {
        free_.push_back(static_cast<std::uint32_t>(kept_.size()));
        kept_.emplace_back();
      }
      place_[index] = free_.back();
      free_.pop_back();
    }
    kept_[place_[index]] = region;
  }

  double thinness(std::uint32_t triangle) const {
    const std::array<std::uint32_t, 3> v = mesh_.corners(triangle);
    double longest2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d e = points_[v[(k + 1) % 3]] - points_[v[k]];
      longest2 = std::max(longest2, glm::dot(e, e));
    }
    return std::min(1.0, glm::length(normalOf(triangle)) / std::sqrt(longest2) / kCreaseFadeTexels);
  }

  void makeBorders() {
    for (std::uint32_t t = 0; t < mesh_.size(); ++t) {
      const Vec3d a = normalOf(t);
      const double ownThinness = thinness(t);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t other = mesh_.neighbour(t, k);
        if (other <= static_cast<std::int32_t>(t)) continue;
        const auto u = static_cast<std::uint32_t>(other);
        Border& border = borders_[borders_.between(t, u)];
        const double length = edgeLength(t, k);
        const Vec3d b = normalOf(u);
        const double bend = 1 - glm::dot(a, b) / (glm::length(a) * glm::length(b));
        const double weight = (mesh_.isHard(t, k) ? 1.0 : kSmoothCrease) * std::min(ownThinness, thinness(u));
        border.absorb({static_cast<float>(length), static_cast<float>(length * weight * std::max(0.0, bend))});
      }
    }
  }

  /// Infinite where the merge is out of the question.
  double cost(std::uint32_t index) const {
    const Border& border = borders_[index];
    const Region a = regionOf(borders_.ends(index)[0]);
    const Region b = regionOf(borders_.ends(index)[1]);
    const Vec3 extent = glm::max(a.high, b.high) - glm::min(a.low, b.low);
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (static_cast<double>(std::max({extent.x, extent.y, extent.z})) > options_.largestSide) return kNever;
    const double area = a.normals.area + b.normals.area;
    const double slack = smallChartSlack(area);
    const double length = static_cast<double>(border.length);
    const double crease = static_cast<double>(border.crease) / length;
    if (crease > std::min(kMostCrease, (1 - options_.maxCreaseCosine) * slack)) return kNever;
    const double bend = NormalMoments(a.normals, b.normals).coneVariance() / options_.maxConeVariance;
    if (bend > slack) return kNever;
    const double perimeter = a.perimeter + b.perimeter - 2 * length;
    const double roundness = perimeter * perimeter / (4 * std::numbers::pi * area);
    return withoutNoise(bend + crease + kShapeWeight * roundness);
  }

  void merge(std::uint32_t border) {
    auto [grown, gone] = borders_.ends(border);
    if (borders_.degree(grown) < borders_.degree(gone)) std::swap(grown, gone);
    const bool isPair = place_[grown] == kSingle && place_[gone] == kSingle;
    const Region from = regionOf(gone);
    Region into = regionOf(grown);
    const auto merge = static_cast<std::uint32_t>(tree_.merges.size());
    tree_.merges.push_back({into.node, from.node});
    if (isKept(gone)) free_.push_back(place_[gone]);
    if (isPair) {
      place_[grown] = kPair + merge;
    } else {
      into = united(into, from, borders_[border].length);
      into.node = static_cast<std::uint32_t>(tree_.triangleCount + merge);
      keep(grown, into);
    }
    borders_.merge(gone, grown, [this](std::uint32_t longer) {
      // The longer common border may be a better reason to merge than either part was.
      queue_.push(longer, [this](std::uint32_t b) { return cost(b); });
    });
  }

  void collectRoots() {
    std::vector<std::uint32_t> parent(tree_.triangleCount + tree_.merges.size(), 0);
    for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
    for (std::size_t i = tree_.merges.size(); i-- > 0;) {
      const auto node = static_cast<std::uint32_t>(tree_.triangleCount + i);
      for (const std::uint32_t child : tree_.merges[i]) parent[child] = parent[node];
    }
    std::vector<bool> seen(parent.size(), false);
    for (std::uint32_t t = 0; t < tree_.triangleCount; ++t) {
      if (seen[parent[t]]) continue;
      seen[parent[t]] = true;
      tree_.roots.push_back(parent[t]);
    }
  }

  const HalfEdgeMesh& mesh_;
  const GrowOptions& options_;
  std::vector<Vec3d> points_;
  std::vector<std::uint32_t> place_;  // per region: in kept_, or kSingle, or kPair + its merge
  std::deque<Region> kept_;
  std::vector<std::uint32_t> free_;  // places in kept_
  BorderGraph<Border> borders_;
  BorderQueue queue_;
  MergeTree tree_;
};

}  // namespace

NormalMoments::NormalMoments(const Vec3d& areaNormal) : area(0.5 * glm::length(areaNormal)), sum(0.5 * areaNormal) {
  const Vec3d n = sum / area;
  moment = {n.x * sum.x, n.y * sum.y, n.z * sum.z, n.x * sum.y, n.x * sum.z, n.y * sum.z};
}

NormalMoments::NormalMoments(const NormalMoments& a, const NormalMoments& b)
    : area(a.area + b.area), sum(a.sum + b.sum) {
  for (std::size_t i = 0; i < 6; ++i) moment[i] = a.moment[i] + b.moment[i];
}

double NormalMoments::coneVariance() const {
  const Vec3d n = sum / area;
  const std::array<double, 6> outer = {n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z};
  std::array<double, 6> covariance;
  for (std::size_t i = 0; i < 6; ++i) covariance[i] = moment[i] / area - outer[i];
  return std::max(0.0, smallestEigenvalue(covariance));
}

std::vector<std::uint32_t> MergeTree::trianglesBelow(std::uint32_t node) const {
  std::vector<std::uint32_t> found;
  std::vector<std::uint32_t> open = {node};
  while (!open.empty()) {
    const std::uint32_t top = open.back();
    open.pop_back();
    if (isLeaf(top)) {
      found.push_back(top);
      continue;
    }
    open.insert(open.end(), children(top).begin(), children(top).end());
  }
  std::sort(found.begin(), found.end());
  found.shrink_to_fit();
  return found;
}

MergeTree growCharts(const HalfEdgeMesh& mesh, const GrowOptions& options) { return Grower(mesh, options).grow(); }

}  // namespace lumel
