// Order of elimination for matrices over a surface's points.
// George 1973, "Nested Dissection of a Regular Finite Element Mesh".
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// Points that are eliminated together: a few that are left in the end of a cut, or those that part two halves.
struct DissectionNode {
  std::uint32_t begin = 0, end = 0;    // into Dissection::order
  std::int32_t left = -1, right = -1;  // nodes of the two halves; both before this one, with all that is below them
};

struct Dissection {
  std::vector<std::uint32_t> order;   // points, as a factorization should eliminate them
  std::vector<DissectionNode> nodes;  // children before parents, ranges ascending and without gaps
};

/// Halves first, the points that part them last, each half likewise. Halves are cut at the median along the longest
/// side of their box, so the parting line of a surface of n points has about sqrt(n) and a factor n log n entries.
Dissection nestedDissection(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace lumel
