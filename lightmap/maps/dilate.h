// Filling of texels without a value of their own, so that bilinear lookup and mip maps never read black.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/image.h"

namespace lumel {

/// Which texels hold a value of their own.
struct TexelMask {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> known;  // width * height, row by row; 0 or 1
};

/// Grows known texels into unknown ones by `rings` texels: each new texel is the mean of its known 8-neighbours,
/// nearest ring first. `mask` gains the filled texels. Values of known texels are untouched.
void dilate(Image& image, TexelMask& mask, int rings);

/// Gives every texel in `holes` (covered but invalid) the values of the nearest known texels of the same chart;
/// `chartIds` per texel (0 = none). Between two sides, as beneath a wall, there is a step in the middle and no ramp, so
/// that lookups beside the wall read the light of their own side. A hole whose chart knows no texel at all keeps its
/// value.
void fillHoles(Image& image, const TexelMask& valid, const std::vector<std::uint32_t>& chartIds,
               const std::vector<std::uint8_t>& holes);

}  // namespace lumel
