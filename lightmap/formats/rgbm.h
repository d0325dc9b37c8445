// RGBM: colours in four bytes, RGB times a common multiplier in alpha, for programs that read 8-bit images alone.
//   L = range * (M * RGB)^2, M and RGB from 0 to 1
// The square is a gamma of 2: the smallest step is range / 65025 in place of range / 255. PlayCanvas decodes so, with a
// range of 64.
#pragma once

#include "scene/base/math.h"
#include "scene/image.h"

namespace lumel {

/// `color`: not negative, none above `range` (> 0). The result holds whole 255ths: RGB and M.
Vec4 rgbmFromColor(const Vec3& color, float range);
Vec3 colorFromRgbm(const Vec4& rgbm, float range);

/// RGB to RGBA, texel by texel, and back.
Image encodeRgbm(const Image& rgb, float range);
Image decodeRgbm(const Image& rgbm, float range);

}  // namespace lumel
