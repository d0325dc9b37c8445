// Disjoint sets (union-find) as an array of parents; a set is named by its smallest item, its root, which is its own
// parent.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace lumel {

/// The root of the set that holds x. Halves the path to it.
inline std::uint32_t findRoot(std::vector<std::uint32_t>& parent, std::uint32_t x) {
  while (parent[x] != x) x = parent[x] = parent[parent[x]];
  return x;
}

/// Joins the sets of a and b; the smaller root becomes the root of both.
inline void unite(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b) {
  a = findRoot(parent, a);
  b = findRoot(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

}  // namespace lumel
