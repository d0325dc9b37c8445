#include "baker/texel_sums.h"

#include <cmath>

namespace lumel {

SampleValue TexelSums::mean() const {
  SampleValue value;
  if (count_ == 0) return value;
  const double scale = 1.0 / count_;
  value.flat = Vec3(flat_ * scale);
  for (std::size_t i = 0; i < 3; ++i) value.rnm[i] = Vec3(rnm_[i] * scale);
  return value;
}

float TexelSums::validity() const {
  if (gatherRays_ == 0) return 1.0f;
  return static_cast<float>(1.0 - static_cast<double>(backFaces_) / gatherRays_);
}

float TexelSums::standardError() const {
  if (count_ < 2) return 0.0f;
  double sum = 0.0;
  for (const double s : batchSum_) sum += s;
  const double mean = sum / count_;
  // Batches may differ in size by one sample: each counts by its share of the samples.
  double spread = 0.0;
  int batches = 0;
  for (std::size_t b = 0; b < kBatches; ++b) {
    if (batchCount_[b] == 0) continue;
    ++batches;
    const double excess = batchSum_[b] - mean * batchCount_[b];
    spread += excess * excess;
  }
  if (batches < 2) return 0.0f;
  const double variance = spread / (static_cast<double>(count_) * count_) * batches / (batches - 1);
  return static_cast<float>(std::sqrt(variance));
}

}  // namespace lumel
