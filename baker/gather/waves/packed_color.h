// Light or a share of it in eight bytes, for tables that rays look up all over the memory: three floats of 21 bits
// without signs, 8 of them exponent and 13 mantissa. Rounded to nearest, so that a value is off by 2^-14 at most and a
// mean over many by nothing.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "scene/base/math.h"

namespace lumel {

struct PackedColor {
  std::uint32_t redAndGreen = 0;   // red, and the upper 11 bits of green
  std::uint32_t blueAndGreen = 0;  // blue, and the lower 10 bits of green, below a bit that is zero
};

/// Components that are negative become 0, those that are not finite stay so.
inline PackedColor packColor(const Vec3& color) {
  const auto pack = [](float value) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(value < 0.0f ? 0.0f : value) & 0x7fffffffu;
    const std::uint32_t rounded = bits + 0x1ffu + ((bits >> 10) & 1u);  // ties to even
    return std::min(rounded, 0x7fffffffu) >> 10;                        // whatever a NaN has in its lower bits
  };
  const std::uint32_t red = pack(color.x), green = pack(color.y), blue = pack(color.z);
  return {(red << 11) | (green >> 10), (blue << 11) | (green & 0x3ffu)};
}

/// By words, for loops over lanes.
[[gnu::always_inline]] inline Vec3 unpackColor(std::uint32_t redAndGreen, std::uint32_t blueAndGreen) {
  const std::uint32_t green = ((redAndGreen & 0x7ffu) << 20) | ((blueAndGreen & 0x3ffu) << 10);
  return {std::bit_cast<float>((redAndGreen & 0xfffff800u) >> 1), std::bit_cast<float>(green),
          std::bit_cast<float>((blueAndGreen & 0xfffff800u) >> 1)};
}
inline Vec3 unpackColor(const PackedColor& color) { return unpackColor(color.redAndGreen, color.blueAndGreen); }

}  // namespace lumel
