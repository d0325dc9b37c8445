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

std::array<float, 1 + kMostMaps> TexelSums::luminancesBefore(int batch) const {
  std::array<double, 1 + kMostMaps> sums{};
  std::uint32_t count = 0;
  for (std::size_t b = 0; b < static_cast<std::size_t>(batch); ++b) {
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += batchSum_[b][i];
    count += batchCount_[b];
  }
  std::array<float, 1 + kMostMaps> means{};
  if (count > 0)
    for (std::size_t i = 0; i < sums.size(); ++i) means[i] = static_cast<float>(sums[i] / count);
  return means;
}

}  // namespace lumel
