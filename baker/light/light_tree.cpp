#include "baker/light/light_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/base/sobol.h"

namespace lumel {
namespace {

constexpr int kBins = 12;
/// Groups below this level are halved by number, so that the depth stays bounded.
constexpr int kHalveBelow = 32;

/// The mean of 1 + 2 cosTheta over a hemisphere.
constexpr float kAnySide = 2.0f;

[[gnu::always_inline]] inline float rootOf(float x) { return std::sqrt(pick(x > 0.0f, x, 0.0f)); }
[[gnu::always_inline]] inline float sineOf(float cosine) { return rootOf(1.0f - cosine * cosine); }

/// An angle in [0, pi] by its cosine and sine; lessened(a, b) is max(0, a - b).
struct Angle {
  float cosine = 1.0f;
  float sine = 0.0f;
};
[[gnu::always_inline]] inline Angle lessened(const Angle& a, const Angle& b) {
  const bool none = a.cosine > b.cosine;
  return {pick(none, 1.0f, a.cosine * b.cosine + a.sine * b.sine),
          pick(none, 0.0f, a.sine * b.cosine - a.cosine * b.sine)};
}

/// Widens the cone of `a` to the smallest one about both: its axis lies between theirs.
void uniteCones(LightBounds& a, const LightBounds& b) {
  a.cosEmit = std::min(a.cosEmit, b.cosEmit);
  const float angleA = std::acos(std::clamp(a.cosSpread, -1.0f, 1.0f));
  const float angleB = std::acos(std::clamp(b.cosSpread, -1.0f, 1.0f));
  const float between = std::acos(std::clamp(glm::dot(a.axis, b.axis), -1.0f, 1.0f));
  if (std::min(between + angleB, kPi) <= angleA) return;
  if (std::min(between + angleA, kPi) <= angleB) {
    a.axis = b.axis;
    a.cosSpread = b.cosSpread;
    return;
  }
  const float angle = 0.5f * (angleA + between + angleB);
  const Vec3 side = b.axis - a.axis * glm::dot(a.axis, b.axis);
  const float length = glm::length(side);
  if (!(angle < kPi) || !(length > 1e-6f)) {
    a.cosSpread = -1.0f;
    return;
  }
  const float turn = angle - angleA;
  a.axis = glm::normalize(a.axis * std::cos(turn) + side * (std::sin(turn) / length));
  // A little wider, for rounding.
  a.cosSpread = std::cos(std::min(kPi, angle + 1e-3f));
}

void unite(LightBounds& a, const LightBounds& b) {
  if (!(a.power > 0.0f)) {
    a = b;
    return;
  }
  if (!(b.power > 0.0f)) return;
  a.min = glm::min(a.min, b.min);
  a.max = glm::max(a.max, b.max);
  a.power += b.power;
  a.reach = std::max(a.reach, b.reach);
  uniteCones(a, b);
}

/// Returns the cost of a group (Conty Estevez and Kulla, eq. 1): power times the measure of the directions that it
/// shines in times its surface.
float groupCost(const LightBounds& bounds) {
  const float spread = std::acos(std::clamp(bounds.cosSpread, -1.0f, 1.0f));
  const float emit = std::acos(std::clamp(bounds.cosEmit, -1.0f, 1.0f));
  const float all = std::min(kPi, spread + emit);
  const float directions =
      2.0f * kPi * (1.0f - std::cos(spread)) + 0.5f * kPi *
                                                   (2.0f * all * std::sin(spread) - std::cos(spread - 2.0f * all) -
                                                    2.0f * spread * std::sin(spread) + std::cos(spread));
  const Vec3 size = bounds.max - bounds.min;
  // The diagonal keeps groups on a line apart.
  const float surface = 2.0f * (size.x * size.y + size.y * size.z + size.z * size.x) + glm::dot(size, size);
  return bounds.power * std::max(directions, 1e-3f) * surface;
}

Vec3 centreOf(const LightBounds& bounds) { return 0.5f * (bounds.min + bounds.max); }

struct Split {
  int axis = -1;
  float at = 0.0f;  // centres below go to the left
};

Split bestSplit(std::span<const LightBounds> lights, std::span<const std::uint32_t> group) {
  Vec3 least(std::numeric_limits<float>::max());
  Vec3 most(std::numeric_limits<float>::lowest());
  for (const std::uint32_t light : group) {
    least = glm::min(least, centreOf(lights[light]));
    most = glm::max(most, centreOf(lights[light]));
  }
  const Vec3 size = most - least;
  const float longest = std::max({size.x, size.y, size.z});
  Split best;
  float bestCost = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (!(size[axis] > 0.0f)) continue;
    std::array<LightBounds, kBins> bins;
    const float scale = kBins / size[axis];
    for (const std::uint32_t light : group) {
      const float place = (centreOf(lights[light])[axis] - least[axis]) * scale;
      unite(bins[static_cast<std::size_t>(std::clamp(place, 0.0f, kBins - 1.0f))], lights[light]);
    }
    std::array<float, kBins> below{};
    LightBounds sum;
    for (std::size_t i = 0; i + 1 < kBins; ++i) {
      unite(sum, bins[i]);
      below[i + 1] = sum.power > 0.0f ? groupCost(sum) : 0.0f;
    }
    sum = {};
    for (std::size_t i = kBins - 1; i > 0; --i) {
      unite(sum, bins[i]);
      // Thin slices are worse than the surface alone says.
      const float cost = (below[i] + (sum.power > 0.0f ? groupCost(sum) : 0.0f)) * (longest / size[axis]);
      if (cost < bestCost) {
        bestCost = cost;
        best = {axis, least[axis] + static_cast<float>(i) / scale};
      }
    }
  }
  return best;
}

}  // namespace

/// Returns u with random bits below those that a float holds: halving an interval over and over would run out of them.
[[gnu::always_inline]] static inline double refined(float u, const Vec3& p) {
  std::uint32_t bits = hashBits(std::bit_cast<std::uint32_t>(u));
  bits = hashCombine(bits, std::bit_cast<std::uint32_t>(p.x));
  bits = hashCombine(bits, std::bit_cast<std::uint32_t>(p.y));
  bits = hashCombine(bits, std::bit_cast<std::uint32_t>(p.z));
  return static_cast<double>(u) + static_cast<double>(bits) * 0x1p-56;
}

LightTree::LightTree(std::span<const LightBounds> lights) {
  leafOf_.assign(lights.size(), kNone);
  for (std::uint32_t i = 0; i < lights.size(); ++i)
    if (lights[i].power > 0.0f && std::isfinite(lights[i].power)) order_.push_back(i);
  bounded_ = std::any_of(lights.begin(), lights.end(), [](const LightBounds& b) { return std::isfinite(b.reach); });
  if (!order_.empty()) build(lights, 0, order_.size(), kNone, 0);
}

void LightTree::build(std::span<const LightBounds> lights, std::size_t first, std::size_t count, std::uint32_t parent,
                      int depth) {
  const auto at = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back().parent = parent;
  groups_.emplace_back();
  const std::span<std::uint32_t> group = std::span(order_).subspan(first, count);
  LightBounds bounds;
  for (const std::uint32_t light : group) unite(bounds, lights[light]);
  groups_[at] = {.centre = centreOf(bounds),
                 .radius2 = 0.25f * glm::dot(bounds.max - bounds.min, bounds.max - bounds.min),
                 .axis = bounds.axis,
                 .power = bounds.power,
                 .half = 0.5f * (bounds.max - bounds.min),
                 .reach = bounds.reach,
                 .cosSpread = bounds.cosSpread,
                 .sinSpread = sineOf(bounds.cosSpread),
                 .cosEmit = bounds.cosEmit};
  if (count <= kLeaf) {
    nodes_[at].first = static_cast<std::uint32_t>(first);
    nodes_[at].count = static_cast<std::uint32_t>(count);
    for (const std::uint32_t light : group) leafOf_[light] = at;
    return;
  }
  std::size_t left = 0;
  if (depth < kHalveBelow) {
    if (const Split split = bestSplit(lights, group); split.axis >= 0)
      left = static_cast<std::size_t>(
          std::stable_partition(group.begin(), group.end(),
                                [&](std::uint32_t light) { return centreOf(lights[light])[split.axis] < split.at; }) -
          group.begin());
  }
  // All in one place, or borders lost to rounding.
  if (left == 0 || left == count) left = count / 2;
  build(lights, first, left, at, depth + 1);
  groups_[at].right = static_cast<int>(nodes_.size());
  build(lights, first + left, count - left, at, depth + 1);
}

template <bool kOpen>
[[gnu::always_inline]] inline float LightTree::importanceOf(const Group& group, const LightQuery& query) {
  const Vec3 toCentre = group.centre - query.p;
  const float distance2 = glm::dot(toCentre, toCentre);
  // Seen from inside of the bounding sphere, lights may lie in any direction and shine from any side.
  const bool isOutside = distance2 > group.radius2;
  const float inside =
      pick(group.radius2 > 0.0f, kAnySide * group.power / pick(group.radius2 > 0.0f, group.radius2, 1.0f), 0.0f);
  const float perDistance2 = 1.0f / pick(isOutside, distance2, 1.0f);
  const Vec3 wi = toCentre * std::sqrt(perDistance2);
  const float sine2 = group.radius2 * perDistance2;
  // A little wider than the sphere looks, for rounding.
  const Angle around{rootOf(1.0f - sine2) - 1e-4f, within(std::sqrt(sine2) + 1e-4f, 0.0f, 1.0f)};
  const float cosAxis = within(-glm::dot(group.axis, wi), -1.0f, 1.0f);
  const Angle off = lessened(lessened({cosAxis, sineOf(cosAxis)}, {group.cosSpread, group.sinSpread}), around);
  const float importance = pick(off.cosine > group.cosEmit, group.power * off.cosine * perDistance2, 0.0f);
  if constexpr (kOpen) return pick(isOutside, importance * kAnySide, inside);
  const auto beyond = [](float to, float half) { return pick(std::abs(to) > half, std::abs(to) - half, 0.0f); };
  const Vec3 outside(beyond(toCentre.x, group.half.x), beyond(toCentre.y, group.half.y),
                     beyond(toCentre.z, group.half.z));
  const bool reaches = !(glm::dot(outside, outside) > group.reach * group.reach);
  const float cosTheta = within(glm::dot(query.n, wi), -1.0f, 1.0f);
  const float most = lessened({cosTheta, sineOf(cosTheta)}, around).cosine;
  // The tilted basis vectors need light at grazing angles, too, so the weight is that of gather directions.
  const float bySide = pick(most > 0.0f, 1.0f + 2.0f * most, 0.0f);
  const bool anySide = (query.n.x == 0.0f) & (query.n.y == 0.0f) & (query.n.z == 0.0f);
  return pick(reaches, pick(isOutside, importance * pick(anySide, kAnySide, bySide), inside), 0.0f);
}

float LightTree::importance(const LightQuery& query) const { return empty() ? 0.0f : importanceOf(groups_[0], query); }

std::array<float, 2> LightTree::importancesBelow(std::uint32_t node, const LightQuery& query) const {
  return {importanceOf(groups_[node + 1], query), importanceOf(groups_[rightOf(node)], query)};
}

struct alignas(64) LightTree::GroupLanes {
  Vec3Lanes centre;
  float radius2[kLanes];
  Vec3Lanes axis;
  float power[kLanes];
  Vec3Lanes half;
  float reach[kLanes];
  float cosSpread[kLanes];
  float sinSpread[kLanes];
  float cosEmit[kLanes];
  int right[kLanes];

  Group operator[](std::size_t lane) const {
    return {centre[lane], radius2[lane],   axis[lane],      power[lane],   half[lane],
            reach[lane],  cosSpread[lane], sinSpread[lane], cosEmit[lane], right[lane]};
  }
};

template <bool kOpen>
[[gnu::always_inline]] inline void LightTree::descendLanes(const Group* groups, const Vec3Lanes& p, const Vec3Lanes& n,
                                                           const LaneFlags& active, const float* u, Descent& descent) {
  static_assert(sizeof(GroupLanes) == kLanes * sizeof(Group));
  LaneFlags goesOn, left, right;
  const int rightOfRoot = groups[0].right;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const double fine = refined(u[lane], p[lane]);
    descent.rest[lane] = rightOfRoot != 0 ? fine : static_cast<double>(u[lane]);
    descent.probability[lane] = pick(active[lane] != 0, 1.0f, 0.0f);
    descent.leaf[lane] = 0;
    goesOn[lane] = (active[lane] != 0) & (rightOfRoot != 0) ? 1 : 0;
    right[lane] = goesOn[lane] ? rightOfRoot : 0;
  }
  GroupLanes first, second;
  alignas(64) float ofLeft[kLanes], ofRight[kLanes];
  for (;;) {
    int any = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      // Those that have arrived stay where they are.
      left[lane] = descent.leaf[lane] + goesOn[lane];
      any |= goesOn[lane];
    }
    if (any == 0) return;
    turnRecords(groups, left, &first);
    turnRecords(groups, right, &second);
    // A loop of its own: in one with what follows the compiler finds branches and leaves it scalar.
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const LightQuery query{p[lane], kOpen ? Vec3(0.0f) : n[lane]};
      ofLeft[lane] = importanceOf<kOpen>(first[lane], query);
      ofRight[lane] = importanceOf<kOpen>(second[lane], query);
    }
#pragma GCC ivdep
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const bool goes = goesOn[lane] != 0;
      const float total = ofLeft[lane] + ofRight[lane];
      const bool some = total > 0.0f;
      const float share = ofLeft[lane] / pick(some, total, 1.0f);
      const double rest = descent.rest[lane];
      const auto border = static_cast<double>(share);
      const bool toLeft = (rest < border) | !(ofRight[lane] > 0.0f);
      const double below = toLeft ? rest : rest - border;
      const double width = toLeft ? border : 1.0 - border;
      const double perWidth = below / width;
      descent.rest[lane] = goes & some ? perWidth : rest;
      const float stepped = descent.probability[lane] * pick(toLeft, share, 1.0f - share);
      descent.probability[lane] = pick(goes, pick(some, stepped, 0.0f), descent.probability[lane]);
      const int child = toLeft ? left[lane] : right[lane];
      const int beyond = toLeft ? first.right[lane] : second.right[lane];
      const bool further = goes & some & (beyond != 0);
      descent.leaf[lane] = goes & some ? child : descent.leaf[lane];
      right[lane] = further ? beyond : descent.leaf[lane];
      goesOn[lane] = further ? 1 : 0;
    }
  }
}

LUMEL_FOR_EACH_CPU void LightTree::descendOpen(const Group* groups, const Vec3Lanes& p, const LaneFlags& active,
                                               const float* u, Descent& descent) {
  descendLanes<true>(groups, p, p, active, u, descent);
}

LUMEL_FOR_EACH_CPU void LightTree::descendSided(const Group* groups, const Vec3Lanes& p, const Vec3Lanes& n,
                                                const LaneFlags& active, const float* u, Descent& descent) {
  descendLanes<false>(groups, p, n, active, u, descent);
}

void LightTree::descend(const Vec3Lanes& p, const Vec3Lanes* n, const LaneFlags& active, const float* u,
                        Descent& descent) const {
  if (n == nullptr && !bounded_)
    descendOpen(groups_.data(), p, active, u, descent);
  else
    descendSided(groups_.data(), p, n == nullptr ? Vec3Lanes() : *n, active, u, descent);
}

void LightTree::lightsOf(const Descent& descent, std::array<LaneFlags, kLeaf>& lights) const {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Node& leaf = nodes_[static_cast<std::size_t>(descent.leaf[lane])];
    const std::uint32_t count = descent.probability[lane] > 0.0f ? leaf.count : 0u;
    for (std::uint32_t i = 0; i < kLeaf; ++i)
      lights[i][lane] = i < count ? static_cast<int>(order_[leaf.first + i]) : kNoLight;
  }
}

}  // namespace lumel
