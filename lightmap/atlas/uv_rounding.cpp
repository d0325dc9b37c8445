#include "lightmap/atlas/uv_rounding.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace lumel {
namespace {

constexpr double kStep = 1.0 / (1 << 24);  // of the page: what a float in [0.5, 1) can tell apart
constexpr double kFarthestTexels = 1e-3;   // that a corner is moved: less than any lookup can tell
constexpr int kPasses = 8;                 // a fan of slivers straightens one triangle at a time

/// Twice the area in texels of a triangle with UVs on a page (v down), positive where it is counter-clockwise as seen;
/// less that of a triangle a quarter of a step high, which is none at all.
double sureArea(std::span<const Vec2> uvs, const std::array<std::uint32_t, 3>& triangle, Vec2d pageSize) {
  const Vec2d a = (Vec2d(uvs[triangle[1]]) - Vec2d(uvs[triangle[0]])) * pageSize;
  const Vec2d b = (Vec2d(uvs[triangle[2]]) - Vec2d(uvs[triangle[0]])) * pageSize;
  const double longest2 = std::max({glm::dot(a, a), glm::dot(b, b), glm::dot(b - a, b - a)});
  return a.y * b.x - a.x * b.y - 0.25 * kStep * std::max(pageSize.x, pageSize.y) * std::sqrt(longest2);
}

struct Lost {
  int triangles = 0;  // without area or turned over
  double depth = 0;   // how much area they lack, in sum
  bool operator<(const Lost& other) const {
    return triangles != other.triangles ? triangles < other.triangles : depth < other.depth;
  }
};

class Nudger {
 public:
  Nudger(std::span<Vec2> uvs, std::span<const std::array<std::uint32_t, 3>> triangles, Vec2d pageSize)
      : uvs_(uvs), triangles_(triangles), pageSize_(pageSize), original_(uvs.begin(), uvs.end()) {
    start_.assign(uvs.size() + 1, 0);
    for (const auto& t : triangles)
      for (const std::uint32_t v : t) ++start_[v + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    around_.resize(start_.back());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (const std::uint32_t v : triangles[t]) around_[next[v]++] = t;
  }

  void run(std::vector<std::uint32_t> lost) {
    for (int pass = 0; pass < kPasses && !lost.empty(); ++pass) {
      for (const std::uint32_t t : lost)
        if (!(area(t) > 0)) improve(t);
      std::vector<std::uint32_t> next;
      for (const std::uint32_t t : lost)
        for (const std::uint32_t v : triangles_[t])
          for (std::uint32_t i = start_[v]; i < start_[v + 1]; ++i)
            if (!(area(around_[i]) > 0)) next.push_back(around_[i]);
      std::sort(next.begin(), next.end());
      next.erase(std::unique(next.begin(), next.end()), next.end());
      lost = std::move(next);
    }
  }

 private:
  double area(std::uint32_t t) const { return sureArea(uvs_, triangles_[t], pageSize_); }

  Lost lostAround(std::uint32_t vertex) const {
    Lost lost;
    for (std::uint32_t i = start_[vertex]; i < start_[vertex + 1]; ++i)
      if (const double a = area(around_[i]); !(a > 0)) {
        ++lost.triangles;
        lost.depth -= a;
      }
    return lost;
  }

  /// The move of one corner that leaves fewest triangles lost around it, the smallest of equal ones.
  void improve(std::uint32_t t) {
    for (const double steps : {1.0, 2.0, 4.0, 8.0}) {
      Lost best;
      std::uint32_t bestVertex = 0;
      Vec2 bestPlace{};
      bool found = false;
      for (const std::uint32_t v : triangles_[t]) {
        const Vec2 here = uvs_[v];
        const Lost before = lostAround(v);
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            uvs_[v] = Vec2(Vec2d(here) + steps * kStep * Vec2d(dx, dy));
            if (glm::length((Vec2d(uvs_[v]) - Vec2d(original_[v])) * pageSize_) > kFarthestTexels) continue;
            const Lost after = lostAround(v);
            if (!(after < before) || (found && !(after < best))) continue;
            best = after;
            bestVertex = v;
            bestPlace = uvs_[v];
            found = true;
          }
        uvs_[v] = here;
      }
      if (!found) continue;
      uvs_[bestVertex] = bestPlace;
      if (area(t) > 0) return;
    }
  }

  std::span<Vec2> uvs_;
  std::span<const std::array<std::uint32_t, 3>> triangles_;
  Vec2d pageSize_;
  std::vector<Vec2> original_;
  std::vector<std::uint32_t> start_, around_;  // triangles around each vertex
};

}  // namespace

void keepAreasAfterRounding(std::span<Vec2> uvs, std::span<const std::array<std::uint32_t, 3>> triangles,
                            Vec2d pageSize) {
  std::vector<std::uint32_t> lost;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (!(sureArea(uvs, triangles[t], pageSize) > 0)) lost.push_back(t);
  if (!lost.empty()) Nudger(uvs, triangles, pageSize).run(std::move(lost));
}

}  // namespace lumel
