// Takes sampling noise out of a finished page: every texel becomes a weighted mean of itself and of the texels of its
// chart around it that agree with it within their noise (non-local means with known variance: Buades et al. 2005;
// Rousselle et al. 2012, "Adaptive Rendering with Non-Local Means Filtering", eq. 4).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lightmap/maps/encoding.h"
#include "scene/image.h"

namespace lumel {

/// A unit vector times kCoarseNormal, rounded.
using CoarseNormal = std::array<std::int8_t, 3>;
inline constexpr float kCoarseNormal = 127.0f;

/// Standard errors of the luminance of a map, row by row, `stride` floats apart; what is not finite is not known.
struct ErrorPlane {
  float* first = nullptr;
  std::size_t stride = 1;
  float& operator[](std::size_t texel) const { return first[texel * stride]; }
};

/// `flat` and `encoded`, the maps of an encoding: RGB images of one size. Per texel, row by row: `chartIds`, 0 where a
/// texel is neither read nor changed; `normals`, zero where a texel shall agree with no other; `errors` of the flat map
/// and of the others, in which those of the result take the place of those given (README); the weights depend on the
/// flat map's alone. `judges`: the first so many maps tell with the flat one how far texels are apart, at most 6 of
/// them. All maps of a texel are averaged with the same weights, so what
/// holds for them linearly (the mean of three RNM maps is the flat one) goes on to hold. A texel without noise keeps
/// its value among texels that differ from it, but for one factor to all texels and maps of a chart, by which the chart
/// keeps its flat map's mean luminance. Values that are not finite spread no further than the texel. Parallel and
/// deterministic. Memory: 6.5 KiB per texel of the page's width.
void denoise(Image& flat, std::span<Image> encoded, std::span<const std::uint32_t> chartIds,
             std::span<const CoarseNormal> normals, std::span<const ErrorPlane> errors, std::size_t judges = kMostMaps);

}  // namespace lumel
