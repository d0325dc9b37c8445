// IEEE 754 half precision floats (binary16) as bits, by Imath.
#pragma once

#include <Imath/half.h>

#include <cstdint>

namespace lumel {

/// The largest finite half.
inline constexpr float kMostHalf = 65504.0f;

/// The nearest half, ties to even. What rounds to more than kMostHalf becomes infinite; NaN stays NaN.
inline std::uint16_t halfFromFloat(float value) { return imath_float_to_half(value); }
inline float floatFromHalf(std::uint16_t bits) { return imath_half_to_float(bits); }

}  // namespace lumel
