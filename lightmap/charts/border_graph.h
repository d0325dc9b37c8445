// Regions that merge, and the borders between them: the bookkeeping that segmentation and joining of charts share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <vector>

namespace lumel {

/// A cost rounded to 2^-18, so that what is alike but for rounding is taken in the order of its number, whatever the
/// unit of length or a small edit elsewhere made of the last bits.
inline double withoutNoise(double cost) {
  constexpr double kSteps = 1 << 18;
  return std::round(cost * kSteps) / kSteps;
}

/// Each pair of regions has at most one border. `Border` holds what is known of it; `kept.absorb(dropped)` adds up two
/// that become one when a region they share an end with takes in the region at the other end of one of them.
/// Border indices stay what they are; 20 bytes per border and 8 per region beside the borders themselves.
template <class Border>
class BorderGraph {
 public:
  using Index = std::uint32_t;

  /// `borders`: how many there may be, where that is known.
  explicit BorderGraph(std::size_t regions, std::size_t borders = 0) : lists_(regions) {
    borders_.reserve(borders);
    links_.reserve(borders);
  }

  std::size_t size() const { return borders_.size(); }
  Border& operator[](Index border) { return borders_[border]; }
  const Border& operator[](Index border) const { return borders_[border]; }
  const std::array<Index, 2>& ends(Index border) const { return links_[border].end; }
  bool isAlive(Index border) const { return links_[border].end[0] != kNone && links_[border].end[1] != kNone; }
  /// Borders in a region's list, counting some that are gone.
  std::size_t degree(Index region) const { return lists_[region].size; }

  /// The border of two regions, new if they had none.
  Index between(Index a, Index b) {
    if (const Index found = find(a, b); found != kNone) return found;
    const auto border = static_cast<Index>(borders_.size());
    borders_.emplace_back();
    links_.push_back({{a, b}, {kNone, kNone}});
    enlist(border, 0);
    enlist(border, 1);
    insert(border);
    return border;
  }

  /// `into` takes over the borders of `from`; `grown(border)` is called for each that absorbed another.
  template <class Grown>
  void merge(Index from, Index into, Grown grown) {
    Index next = kNone;
    for (Index border = lists_[from].first; border != kNone; border = next) {
      Link& link = links_[border];
      const std::size_t side = sideOf(link, from);
      next = link.next[side];
      if (!isAlive(border)) continue;
      const Index other = link.end[1 - side];
      erase(border);
      link.end[side] = kNone;
      if (other == into) continue;
      if (const Index kept = find(into, other); kept != kNone) {
        borders_[kept].absorb(borders_[border]);
        grown(kept);
      } else {
        link.end[side] = into;
        enlist(border, side);
        insert(border);
      }
    }
    lists_[from] = {};
  }

  /// The borders of a region that are not gone.
  template <class Visit>
  void forEachOf(Index region, Visit visit) const {
    for (Index border = lists_[region].first; border != kNone;
         border = links_[border].next[sideOf(links_[border], region)])
      if (isAlive(border)) visit(border);
  }

 private:
  static constexpr Index kNone = 0xffffffffu;

  /// A border is in the lists of both its regions. One that is gone has lost an end, and stays in the other's list.
  struct Link {
    std::array<Index, 2> end;
    std::array<Index, 2> next;
  };
  struct List {
    Index first = kNone;
    Index size = 0;
  };

  void enlist(Index border, std::size_t side) {
    List& list = lists_[links_[border].end[side]];
    links_[border].next[side] = list.first;
    list.first = border;
    ++list.size;
  }

  // A table of border indices with linear probing (Knuth, vol. 3, 6.4, algorithms L and R), found by their ends.
  std::size_t home(Index a, Index b) const {
    const std::uint64_t key = (static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b);
    return static_cast<std::size_t>((key ^ (key >> 29)) * 0x9e3779b97f4a7c15u >> shift_);
  }

  Index find(Index a, Index b) const {
    if (table_.empty()) return kNone;
    for (std::size_t slot = home(a, b);; slot = (slot + 1) & (table_.size() - 1)) {
      const Index border = table_[slot];
      if (border == kNone) return kNone;
      const std::array<Index, 2>& end = links_[border].end;
      if ((end[0] == a && end[1] == b) || (end[0] == b && end[1] == a)) return border;
    }
  }

  void insert(Index border) {
    if (4 * (used_ + 1) > 3 * table_.size()) enlarge();
    ++used_;
    put(border);
  }

  void put(Index border) {
    std::size_t slot = home(links_[border].end[0], links_[border].end[1]);
    while (table_[slot] != kNone) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = border;
  }

  void enlarge() {
    const std::vector<Index> old = std::move(table_);
    table_.assign(std::max<std::size_t>(16, 2 * old.size()), kNone);
    shift_ = old.empty() ? 60 : shift_ - 1;
    for (const Index border : old)
      if (border != kNone) put(border);
  }

  void erase(Index border) {
    const std::size_t mask = table_.size() - 1;
    std::size_t hole = home(links_[border].end[0], links_[border].end[1]);
    while (table_[hole] != border) hole = (hole + 1) & mask;
    --used_;
    for (std::size_t slot = (hole + 1) & mask; table_[slot] != kNone; slot = (slot + 1) & mask) {
      const std::array<Index, 2>& end = links_[table_[slot]].end;
      // What belongs at or before the hole moves into it.
      if (((slot - home(end[0], end[1])) & mask) < ((slot - hole) & mask)) continue;
      table_[hole] = table_[slot];
      hole = slot;
    }
    table_[hole] = kNone;
  }

  static std::size_t sideOf(const Link& link, Index region) { return link.end[0] == region ? 0 : 1; }

  std::vector<Border> borders_;
  std::vector<Link> links_;
  std::vector<List> lists_;
  std::vector<Index> table_;
  std::size_t used_ = 0;
  int shift_ = 64;
};

/// Borders by the cost of merging across them: the cheapest first, then the first. Infinite costs are left out.
class BorderQueue {
 public:
  template <class Cost>
  void push(std::uint32_t border, Cost cost) {
    if (const double c = cost(border); std::isfinite(c)) queue_.push({static_cast<float>(c), border});
  }

  /// All borders of a graph that are not gone.
  template <class Graph, class Cost>
  void fill(const Graph& graph, Cost cost) {
    std::vector<Candidate> all;
    all.reserve(2 * graph.size());  // with what is pushed later; address space only, until it is used
    for (std::uint32_t border = 0; border < graph.size(); ++border) {
      if (!graph.isAlive(border)) continue;
      if (const double c = cost(border); std::isfinite(c)) all.push_back({static_cast<float>(c), border});
    }
    queue_ = std::priority_queue<Candidate>(std::less<Candidate>(), std::move(all));
  }

  /// Calls merge(border) until the queue is empty. Costs are brought up to date only when they come up: growth of
  /// a region rarely makes a merge cheaper, and whoever knows that it did pushes the border again.
  template <class Graph, class Cost, class Merge>
  void run(const Graph& graph, Cost cost, Merge merge) {
    while (!queue_.empty()) {
      const Candidate top = queue_.top();
      queue_.pop();
      if (!graph.isAlive(top.border)) continue;
      const double now = cost(top.border);
      if (!(now > top.cost * 1.0001 + 1e-9))
        merge(top.border);
      else if (std::isfinite(now))
        queue_.push({static_cast<float>(now), top.border});
    }
  }

 private:
  struct Candidate {
    float cost;
    std::uint32_t border;
    bool operator<(const Candidate& other) const {
      return cost != other.cost ? cost > other.cost : border > other.border;
    }
  };
  std::priority_queue<Candidate> queue_;
};

}  // namespace lumel
