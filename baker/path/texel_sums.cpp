#include "baker/path/texel_sums.h"

namespace lumel {

SampleValue TexelSums::mean() const {
  SampleValue value;
  if (count_ == 0) return value;
  const double scale = 1.0 / count_;
  value.flat = Vec3(flat_ * scale);
  for (std::size_t i = 0; i < kMostMaps; ++i) value.maps[i] = Vec3(maps_[i] * scale);
  return value;
}

float TexelSums::validity() const {
  if (gatherRays_ == 0) return 1.0f;
  return static_cast<float>(1.0 - static_cast<double>(backFaces_) / gatherRays_);
}

float TexelSums::luminanceBefore(int batch) const {
  double sum = 0.0;
  std::uint32_t count = 0;
  for (std::size_t b = 0; b < static_cast<std::size_t>(batch); ++b) {
    sum += batchSum_[b];
    count += batchCount_[b];
  }
  return count == 0 ? 0.0f : static_cast<float>(sum / count);
}

}  // namespace lumel
