#include "lightmap/charts/border_graph.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

namespace lumel {
namespace {

struct Length {
  int value = 0;
  void absorb(const Length& other) { value += other.value; }
};

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// The same by a plain map from pairs of regions.
struct PlainBorders {
  std::map<Pair, int> lengths;

  static Pair key(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }
  void merge(std::uint32_t from, std::uint32_t into) {
    std::map<Pair, int> next;
    for (const auto& [ends, length] : lengths) {
      const std::uint32_t a = ends.first == from ? into : ends.first;
      const std::uint32_t b = ends.second == from ? into : ends.second;
      if (a != b) next[key(a, b)] += length;
    }
    lengths = std::move(next);
  }
};

std::map<Pair, int> contentOf(const BorderGraph<Length>& graph, std::uint32_t regions) {
  std::map<Pair, int> content;
  for (std::uint32_t r = 0; r < regions; ++r)
    graph.forEachOf(r, [&](std::uint32_t border) {
      const auto& [a, b] = graph.ends(border);
      EXPECT_TRUE(a == r || b == r);
      content[PlainBorders::key(a, b)] = graph[border].value;
    });
  return content;
}

TEST(BorderGraph, AgreesWithAPlainMapThroughRandomMerges) {
  std::mt19937 random(7);
  constexpr std::uint32_t kRegions = 60;
  for (int round = 0; round < 20; ++round) {
    BorderGraph<Length> graph(kRegions);
    PlainBorders plain;
    for (int i = 0; i < 150; ++i) {
      const std::uint32_t a = random() % kRegions, b = random() % kRegions;
      if (a == b) continue;
      const int length = static_cast<int>(random() % 100);
      graph[graph.between(a, b)].value += length;
      plain.lengths[PlainBorders::key(a, b)] += length;
    }
    EXPECT_EQ(graph.size(), plain.lengths.size());
    std::vector<std::uint32_t> left(kRegions);
    for (std::uint32_t i = 0; i < kRegions; ++i) left[i] = i;
    while (left.size() > 1) {
      const std::size_t at = random() % left.size();
      const std::uint32_t from = left[at];
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
      const std::uint32_t into = left[random() % left.size()];
      std::map<std::uint32_t, int> before;
      graph.forEachOf(into, [&](std::uint32_t border) { before[border] = graph[border].value; });
      std::set<std::uint32_t> grown;
      graph.merge(from, into, [&](std::uint32_t border) { grown.insert(border); });
      plain.merge(from, into);
      ASSERT_EQ(contentOf(graph, kRegions), plain.lengths);
      for (const auto& [border, value] : before) {
        const bool changed = graph.isAlive(border) && graph[border].value != value;
        EXPECT_TRUE(!changed || grown.contains(border));
      }
    }
  }
}

TEST(BorderGraph, OfRegionsWithoutBordersMergesThem) {
  BorderGraph<Length> graph(2);
  graph.merge(0, 1, [](std::uint32_t) { FAIL() << "no border can have grown"; });
  graph.forEachOf(1, [](std::uint32_t) { FAIL() << "there is none"; });
  EXPECT_EQ(graph.degree(1), 0u);
}

}  // namespace
}  // namespace lumel
