#include "ssbump/occlusion/bilateral.h"

#include <algorithm>
#include <cmath>

#include "scene/base/parallel.h"
#include "ssbump/occlusion/max_levels.h"

namespace lumel::ssbump {
namespace {

/// One row with `radius` wrapped texels on either side; kNoSurface outside a field that does not wrap.
void copyRow(const HeightField& field, int y, int radius, std::vector<float>& out) {
  const bool outside = !field.wrap && (y < 0 || y >= field.height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int x = static_cast<int>(i) - radius;
    const bool none = outside || (!field.wrap && (x < 0 || x >= field.width));
    out[i] = none ? kNoSurface : field.at(x, y);
  }
}

}  // namespace

void bilateralFilter(HeightField& field, int radius, float thresholdTexels, Progress& progress) {
  if (radius <= 0 || !(thresholdTexels > 0)) return;
  const auto width = static_cast<std::size_t>(field.width);
  const float sigma = static_cast<float>(radius) / 2;
  const float inverse = 1 / thresholdTexels;
  std::vector<float> filtered(field.texels.size());
  parallelFor(static_cast<std::size_t>(field.height), 8, [&](std::size_t first, std::size_t last) {
    std::vector<float> neighbours(width + 2 * static_cast<std::size_t>(radius));
    std::vector<float> sum(width), weight(width);
    for (std::size_t y = first; y < last; ++y) {
      const float* own = field.row(static_cast<int>(y));
      std::fill(sum.begin(), sum.end(), 0.0f);
      std::fill(weight.begin(), weight.end(), 0.0f);
      for (int dy = -radius; dy <= radius; ++dy) {
        if (progress.cancelled()) return;
        copyRow(field, static_cast<int>(y) + dy, radius, neighbours);
        for (int dx = -radius; dx <= radius; ++dx) {
          const float spatial = std::exp(-static_cast<float>(dx * dx + dy * dy) / (2 * sigma * sigma));
          const float* in = neighbours.data() + dx + radius;
          for (std::size_t x = 0; x < width; ++x) {
            const float difference = in[x] - own[x];
            const float r = difference * inverse;
            const float keep = std::max(0.0f, 1 - r * r);
            const float w = spatial * keep * keep;
            weight[x] += w;
            // Sums of differences: a flat field stays exactly as it is.
            sum[x] += w > 0 ? w * difference : 0.0f;
          }
        }
      }
      for (std::size_t x = 0; x < width; ++x) filtered[y * width + x] = own[x] + sum[x] / weight[x];
      progress.advance(1);
    }
  });
  if (progress.cancelled()) return;
  field.texels = std::move(filtered);
  field.updateRange();
}

}  // namespace lumel::ssbump
