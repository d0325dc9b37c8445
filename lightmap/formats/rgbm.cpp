#include "lightmap/formats/rgbm.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumel {

Vec4 rgbmFromColor(const Vec3& color, float range) {
  const Vec3 root = glm::sqrt(glm::clamp(color / range, Vec3(0.0f), Vec3(1.0f)));
  const float most = std::max({root.x, root.y, root.z});
  if (!(most > 0.0f)) return {0.0f, 0.0f, 0.0f, 1.0f / 255.0f};
  // The least multiplier that still reaches the largest channel leaves the finest steps. Multipliers above it may come
  // closer to the colour: its whole octave would not, so a few are tried.
  const int least = std::clamp(static_cast<int>(std::ceil(most * 255.0f)), 1, 255);
  Vec4 best(0.0f);
  float bestError = std::numeric_limits<float>::max();
  for (int m = least; m <= std::min(least + 3, 255); ++m) {
    const float multiplier = static_cast<float>(m) / 255.0f;
    const Vec3 steps = glm::floor(root / multiplier * 255.0f + 0.5f) / 255.0f;
    const Vec4 candidate(glm::min(steps, Vec3(1.0f)), multiplier);
    const Vec3 off = colorFromRgbm(candidate, range) - color;
    if (const float error = glm::dot(off, off); error < bestError) {
      bestError = error;
      best = candidate;
    }
  }
  return best;
}

Vec3 colorFromRgbm(const Vec4& rgbm, float range) {
  const Vec3 root = rgbm.w * Vec3(rgbm);
  return range * root * root;
}

Image encodeRgbm(const Image& rgb, float range) {
  Image out(rgb.width, rgb.height, 4);
  for (int y = 0; y < rgb.height; ++y)
    for (int x = 0; x < rgb.width; ++x) {
      const Vec4 value = rgbmFromColor(rgb.rgb(x, y), range);
      std::copy_n(&value.x, 4, out.at(x, y));
    }
  return out;
}

Image decodeRgbm(const Image& rgbm, float range) {
  Image out(rgbm.width, rgbm.height, 3);
  for (int y = 0; y < rgbm.height; ++y)
    for (int x = 0; x < rgbm.width; ++x) {
      const float* p = rgbm.at(x, y);
      out.setRgb(x, y, colorFromRgbm({p[0], p[1], p[2], p[3]}, range));
    }
  return out;
}

}  // namespace lumel
