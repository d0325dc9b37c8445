// Sets that grow together, held as parents: an item is its own parent where it stands for its set.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace lumel {

/// What stands for the set of x; halves the path to it.
inline std::uint32_t findRoot(std::vector<std::uint32_t>& parent, std::uint32_t x) {
  while (parent[x] != x) x = parent[x] = parent[parent[x]];
  return x;
}

/// Joins the sets of a and b; the smaller of what stood for them stands for both.
inline void unite(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b) {
  a = findRoot(parent, a);
  b = findRoot(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

}  // namespace lumel
