// IEEE 754 half precision floats (binary16) as bits.
#pragma once

#include <bit>
#include <cstdint>

namespace lumel {

/// The largest finite half.
inline constexpr float kMostHalf = 65504.0f;

/// The nearest half, ties to even. What is beyond kMostHalf becomes infinite as IEEE 754 has it; NaN stays NaN.
inline std::uint16_t halfFromFloat(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000u);
  const std::uint32_t size = bits & 0x7fffffffu;
  if (size > 0x7f800000u) return sign | 0x7e00u;
  if (size >= 0x477ff000u) return sign | 0x7c00u;  // 65520 and more round up to infinity
  // Adding a float whose last place is a half's makes the processor round to it.
  if (size < 0x38800000u) {
    const float rounded = std::bit_cast<float>(size) + 0.5f;
    return static_cast<std::uint16_t>(sign | (std::bit_cast<std::uint32_t>(rounded) - 0x3f000000u));
  }
  const std::uint32_t odd = size >> 13 & 1u;
  return static_cast<std::uint16_t>(sign | ((size - 0x38000000u + 0xfffu + odd) >> 13));
}

inline float floatFromHalf(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16;
  const std::uint32_t size = half & 0x7fffu;
  if (size >= 0x7c00u) return std::bit_cast<float>(sign | 0x7f800000u | (size & 0x3ffu) << 13);
  if (size < 0x400u) {  // zero and denormals: size * 2^-24
    const float value = static_cast<float>(size) * 0x1p-24f;
    return sign != 0 ? -value : value;
  }
  return std::bit_cast<float>(sign | ((size << 13) + 0x38000000u));
}

}  // namespace lumel
