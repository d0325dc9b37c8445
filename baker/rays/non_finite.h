// Samples that are not finite are counted and named. Infinite light is cut to a large number; what is no number is left
// out.
#pragma once

#include <cstdint>

#include "lightmap/texels/texels.h"

namespace lumel {

/// A sample brings no more than this to a map; light that is brighter, or infinite, is cut to it and named. Sums of
/// millions of such samples are still floats.
inline constexpr float kMostSampleLight = 1e31f;

/// Names a sample that was cut because it was too bright for a float, or left out because it was not a number.
struct NonFiniteSample {
  std::uint32_t page = 0;
  TexelCoord texel;
  std::uint32_t sample = 0;
};

}  // namespace lumel
