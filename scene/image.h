// A plain float image, the type that travels between files and algorithms.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// Linear float pixels, interleaved by channel, rows from the top of the image down: pixel (x, y) starts at
/// pixels[(y * width + x) * channels].
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<float> pixels;

  Image() = default;
  Image(int w, int h, int c, float fill = 0.0f)
      : width(w),
        height(h),
        channels(c),
        pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * static_cast<std::size_t>(c), fill) {}

  bool empty() const { return pixels.empty(); }
  float* at(int x, int y) {
    return pixels.data() +
           (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels);
  }
  const float* at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
  Vec3 rgb(int x, int y) const {
    const float* p = at(x, y);
    return {p[0], p[1], p[2]};
  }
  void setRgb(int x, int y, const Vec3& c) {
    float* p = at(x, y);
    p[0] = c.x;
    p[1] = c.y;
    p[2] = c.z;
  }
};

}  // namespace lumel
