// Samples that are not finite: counted and named, never silently zeroed.
#pragma once

#include <cstdint>

#include "lightmap/texels/texels.h"

namespace lumel {

/// Names a sample that was left out because it was not finite.
struct NonFiniteSample {
  std::uint32_t page = 0;
  TexelCoord texel;
  std::uint32_t sample = 0;
};

}  // namespace lumel
