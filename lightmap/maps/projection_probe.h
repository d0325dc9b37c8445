// Normals that judge a projection: at some texels the true light on them is summed beside the maps.
#pragma once

#include <array>
#include <cmath>

#include "scene/base/math.h"

namespace lumel {

/// Every so many texels of a page one is probed.
inline constexpr std::size_t kProbeStride = 64;

/// Flat, and six tangent-space normals tilted by 15 and 30 degrees.
inline constexpr std::size_t kProbeNormals = 7;
inline const std::array<Vec3, kProbeNormals>& probeNormals() {
  static const std::array<Vec3, kProbeNormals> normals = [] {
    std::array<Vec3, kProbeNormals> n;
    n[0] = {0, 0, 1};
    for (int i = 0; i < 6; ++i) {
      const float tilt = (i % 2 == 0 ? 15.0f : 30.0f) * kPi / 180.0f;
      const float azimuth = static_cast<float>(i) * kPi / 3.0f;
      n[static_cast<std::size_t>(i) + 1] = {std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                                            std::cos(tilt)};
    }
    return n;
  }();
  return normals;
}

}  // namespace lumel
