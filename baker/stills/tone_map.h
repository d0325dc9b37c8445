// From linear radiance to what a screen shows.
#pragma once

#include "scene/image.h"

namespace lumel {

enum class ToneMap {
  Aces,    // filmic curve: the rational fit of Narkowicz 2015 to the ACES reference transform
  Linear,  // clipped at 1
};

/// Exposure in stops (a factor of 2^EV) that brings the geometric mean of what is in the picture to middle grey
/// without burning out its bright parts. `lit` chooses the pixels: neither a bright sky nor a lamp in view darkens
/// the scene.
/// 0 where nothing is lit.
float autoExposure(const Image& radiance, const Image& lit);

/// sRGB-encoded values in 0..1, ready for an 8-bit file.
Image toneMap(const Image& radiance, float exposure, ToneMap curve);

}  // namespace lumel
