#include "lightmap/charts/nested_dissection.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace lumel {
namespace {

constexpr std::size_t kLeafPoints = 8;  // so few nearly fill up in any order

class Dissector {
 public:
  Dissector(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles)
      : points_(points), start_(points.size() + 1, 0), half_(points.size(), 0), order_(points.size()) {
    for (const auto& t : triangles)
      for (const std::uint32_t v : t) start_[v + 1] += 2;
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    neighbours_.resize(start_.back());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (const auto& t : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        neighbours_[next[t[k]]++] = t[(k + 1) % 3];
        neighbours_[next[t[k]]++] = t[(k + 2) % 3];
      }
    std::iota(order_.begin(), order_.end(), 0u);
  }

  Dissection run() {
    if (!order_.empty()) order(0, static_cast<std::uint32_t>(order_.size()));
    return {std::move(order_), std::move(nodes_)};
  }

 private:
  int longestAxis(std::span<const std::uint32_t> part) const {
    Vec3d low(std::numeric_limits<double>::infinity());
    Vec3d high = -low;
    for (const std::uint32_t v : part) {
      low = glm::min(low, points_[v]);
      high = glm::max(high, points_[v]);
    }
    const Vec3d size = high - low;
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  }

  /// Orders a range and returns its node.
  std::int32_t order(std::uint32_t begin, std::uint32_t end) {
    const std::span<std::uint32_t> part(order_.data() + begin, end - begin);
    DissectionNode node{begin, end};
    if (part.size() > kLeafPoints) {
      const auto [left, between] = cut(part);
      node.begin = end - between;
      node.left = order(begin, begin + left);
      node.right = order(begin + left, node.begin);
    }
    nodes_.push_back(node);
    return static_cast<std::int32_t>(nodes_.size()) - 1;
  }

  /// Puts the left half first, then the right one, then what parts them; returns the first and last count.
  std::pair<std::uint32_t, std::uint32_t> cut(std::span<std::uint32_t> part) {
    const int axis = longestAxis(part);
    const auto middle = part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2);
    std::nth_element(part.begin(), middle, part.end(), [&](std::uint32_t a, std::uint32_t b) {
      return points_[a][axis] != points_[b][axis] ? points_[a][axis] < points_[b][axis] : a < b;
    });
    // Parts are numbered as they are cut, so that a point's number tells whether it is in this right half.
    const std::uint32_t right = ++parts_;
    for (auto i = middle; i != part.end(); ++i) half_[*i] = right;
    const auto parting = std::stable_partition(part.begin(), middle, [&](std::uint32_t v) {
      return std::none_of(neighbours_.begin() + start_[v], neighbours_.begin() + start_[v + 1],
                          [&](std::uint32_t n) { return half_[n] == right; });
    });
    const auto left = static_cast<std::uint32_t>(parting - part.begin());
    const auto between = static_cast<std::uint32_t>(middle - parting);
    std::rotate(parting, middle, part.end());
    return {left, between};
  }

  std::span<const Vec3d> points_;
  std::vector<std::uint32_t> start_, neighbours_;
  std::vector<std::uint32_t> half_;
  std::vector<std::uint32_t> order_;
  std::vector<DissectionNode> nodes_;
  std::uint32_t parts_ = 0;
};

}  // namespace

Dissection nestedDissection(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles) {
  return Dissector(points, triangles).run();
}

}  // namespace lumel
