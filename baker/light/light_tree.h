// A tree over many lights: descends by how much each half can bring to a point, so that the choice of a light costs
// the logarithm of their number, and the density of the choice is known exactly.
// Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting" (the tree and its
// importance; without the splitting).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "baker/rays/lanes.h"
#include "scene/base/math.h"

namespace lumel {

/// Bounds where a light, or a group of lights, lies and where to it shines.
struct LightBounds {
  Vec3 min{0};  // world
  Vec3 max{0};
  Vec3 axis{0, 0, 1};      // of the cone that holds all directions in which its surfaces face
  float cosSpread = 1.0f;  // half angle of that cone; -1: faces everywhere
  float cosEmit = 0.0f;    // how far from the way it faces a light shines; 0: a hemisphere
  float power = 0.0f;
  float reach = std::numeric_limits<float>::infinity();  // it brings nothing to points further away
};

/// A point that asks for light. A normal of zero leaves the side open.
struct LightQuery {
  Vec3 p{0};
  Vec3 n{0};
};

class LightTree {
 public:
  static constexpr std::size_t kLeaf = 4;

  LightTree() = default;
  /// Lights whose power is not positive and finite are never chosen. Deterministic. Memory: about 80 bytes per light.
  explicit LightTree(std::span<const LightBounds> lights);

  bool empty() const { return nodes_.empty(); }
  /// Returns all lights that can be chosen, in their order, where one leaf holds them; else nothing.
  std::span<const std::uint32_t> onlyLeaf() const {
    return nodes_.size() == 1 ? std::span<const std::uint32_t>(order_) : std::span<const std::uint32_t>();
  }

  struct Choice {
    std::uint32_t light = 0;
    float probability = 0.0f;  // 0: nothing can arrive
  };
  /// Says where the lanes' descents have ended.
  struct Descent {
    alignas(64) double rest[kLanes];
    alignas(64) float probability[kLanes];  // 0: nothing can arrive
    alignas(64) int leaf[kLanes];
  };
  /// The first step of a choice by u in [0, 1): all lanes that are `active` go down to a leaf together.
  /// A null `n` leaves the sides open.
  void descend(const Vec3Lanes& p, const Vec3Lanes* n, const LaneFlags& active, const float* u, Descent& descent) const;
  /// Finds the lights of each lane's leaf, or kNoLight where it has fewer or nothing can arrive.
  static constexpr int kNoLight = -1;
  void lightsOf(const Descent& descent, std::array<LaneFlags, kLeaf>& lights) const;
  /// The second step: among the few lights of a lane's leaf `importance(light)` >= 0 decides, which must not be zero
  /// for a light that brings anything. The probabilities of all lights add up to 1, or to less where whole leaves turn
  /// out to bring nothing.
  template <class Importance>
  Choice chooseInLeaf(const Descent& descent, std::size_t lane, Importance importance) const {
    if (!(descent.probability[lane] > 0.0f)) return {};
    return chooseInLeaf(nodes_[static_cast<std::size_t>(descent.leaf[lane])], descent.rest[lane],
                        descent.probability[lane], importance);
  }

  /// Returns the probability with which the two steps choose `light`, to rounding.
  template <class Importance>
  float probability(const LightQuery& query, std::uint32_t light, Importance importance) const;

  /// Estimates what all lights together bring, for weighing the tree against other lights.
  float importance(const LightQuery& query) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// LightBounds as the descent reads them: a row of 16 floats, to be turned into lanes.
  struct alignas(64) Group {
    Vec3 centre{0};
    float radius2 = 0.0f;  // of the bounding sphere
    Vec3 axis{0};
    float power = 0.0f;
    Vec3 half{0};
    float reach = 0.0f;
    float cosSpread = 1.0f, sinSpread = 0.0f;
    float cosEmit = 0.0f;
    int right = 0;  // child; the left one follows its parent; 0: a leaf
  };
  /// Holds a group for each lane, with members in the same order.
  struct GroupLanes;
  struct Node {
    std::uint32_t parent = kNone;
    std::uint32_t first = 0;  // into order_
    std::uint32_t count = 0;  // 0: not a leaf
  };
  std::uint32_t rightOf(std::uint32_t node) const { return static_cast<std::uint32_t>(groups_[node].right); }
  /// `kOpen` is for queries without a normal and lights that reach everywhere.
  template <bool kOpen = false>
  static float importanceOf(const Group& group, const LightQuery& query);
  /// Returns the importances of a node's children.
  std::array<float, 2> importancesBelow(std::uint32_t node, const LightQuery& query) const;
  template <bool kOpen>
  static void descendLanes(const Group* groups, const Vec3Lanes& p, const Vec3Lanes& n, const LaneFlags& active,
                           const float* u, Descent& descent);
  static void descendOpen(const Group* groups, const Vec3Lanes& p, const LaneFlags& active, const float* u,
                          Descent& descent);
  static void descendSided(const Group* groups, const Vec3Lanes& p, const Vec3Lanes& n, const LaneFlags& active,
                           const float* u, Descent& descent);
  template <class Importance>
  Choice chooseInLeaf(const Node& leaf, double rest, float probability, Importance importance) const;
  void build(std::span<const LightBounds> lights, std::size_t first, std::size_t count, std::uint32_t parent,
             int depth);
  template <class Importance>
  float leafImportances(const Node& leaf, Importance importance, std::array<float, kLeaf>& each) const;

  std::vector<Node> nodes_;
  bool bounded_ = false;               // some lights do not reach everywhere
  std::vector<Group> groups_;          // of the nodes
  std::vector<std::uint32_t> order_;   // lights, leaf by leaf
  std::vector<std::uint32_t> leafOf_;  // per light; kNone: never chosen
};

template <class Importance>
float LightTree::leafImportances(const Node& leaf, Importance importance, std::array<float, kLeaf>& each) const {
  float total = 0.0f;
  for (std::uint32_t i = 0; i < leaf.count; ++i) total += each[i] = importance(order_[leaf.first + i]);
  return total;
}

template <class Importance>
LightTree::Choice LightTree::chooseInLeaf(const Node& leaf, double rest, float probability,
                                          Importance importance) const {
  std::array<float, kLeaf> each{};
  const float total = leafImportances(leaf, importance, each);
  if (!(total > 0.0f)) return {};
  const float target = static_cast<float>(rest) * total;
  float before = 0.0f;
  std::uint32_t chosen = 0;
  for (std::uint32_t i = 0; i < leaf.count; ++i) {
    if (!(each[i] > 0.0f)) continue;
    chosen = i;
    before += each[i];
    if (target < before) break;
  }
  return {order_[leaf.first + chosen], probability * (each[chosen] / total)};
}

template <class Importance>
float LightTree::probability(const LightQuery& query, std::uint32_t light, Importance importance) const {
  if (light >= leafOf_.size() || leafOf_[light] == kNone) return 0.0f;
  std::uint32_t at = leafOf_[light];
  std::array<float, kLeaf> each{};
  const float total = leafImportances(nodes_[at], importance, each);
  if (!(total > 0.0f)) return 0.0f;
  float probability = 0.0f;
  for (std::uint32_t i = 0; i < nodes_[at].count; ++i)
    if (order_[nodes_[at].first + i] == light) probability = each[i] / total;
  for (; nodes_[at].parent != kNone; at = nodes_[at].parent) {
    const std::uint32_t parent = nodes_[at].parent;
    const auto [left, right] = importancesBelow(parent, query);
    if (!(left + right > 0.0f)) return 0.0f;
    const float share = left / (left + right);
    probability *= at == parent + 1 ? share : 1.0f - share;
  }
  return probability;
}

}  // namespace lumel
