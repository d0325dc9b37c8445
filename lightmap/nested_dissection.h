// Order of elimination for matrices over a surface's points.
// George 1973, "Nested Dissection of a Regular Finite Element Mesh".
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/math.h"

namespace lumel {

/// The points in the order in which a factorization should eliminate them: halves first, the points that part them
/// last, each half likewise. Halves are cut at the median along the longest side of their box, so the parting line of a
/// surface of n points has about sqrt(n) and a factor n log n entries.
std::vector<std::uint32_t> nestedDissection(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace lumel
