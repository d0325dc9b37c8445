// Lightmap UVs as floats: rounding must not lose or turn over a triangle.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/base/math.h"

namespace lumel {

/// A float UV on a page of a thousand texels is known to 6e-5 texels. Slivers thinner than that may come out without
/// area or turned over: their corners are moved by steps of that size until every triangle of the chart has area
/// and is counter-clockwise as seen, as far as places can be found within a thousandth of a texel.
/// `uvs`: 0..1 of a page of `pageSize` texels, v down; `triangles`: into `uvs`.
void keepAreasAfterRounding(std::span<Vec2> uvs, std::span<const std::array<std::uint32_t, 3>> triangles,
                            Vec2d pageSize);

}  // namespace lumel
