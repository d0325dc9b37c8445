// Three floats of 9 bits each with one exponent of 5 bits: 32 bits a texel (EXT_texture_shared_exponent; Vulkan's
// E5B9G9R9, Direct3D's R9G9B9E5). Red lies in the lowest bits.
#pragma once

#include <cstdint>

#include "scene/base/math.h"

namespace lumel {

/// The largest value: 511/512 * 2^16.
inline constexpr float kMostRgb9e5 = 65408.0f;

/// The nearest colour that the format holds; negative values become 0, those beyond kMostRgb9e5 that.
std::uint32_t rgb9e5FromColor(const Vec3& color);
Vec3 colorFromRgb9e5(std::uint32_t bits);

}  // namespace lumel
