// The inner loop of the horizon back end: one row of texels, one azimuth, in SIMD for the processor at hand.
#pragma once

#include <cstddef>

#include "ssbump/lobe.h"

namespace lumel::ssbump {

/// Texels that the kernel handles at once: rows are padded to a multiple of this.
inline constexpr int kHorizonBlock = 64;

/// One azimuth of one row. Slopes are (height at the step - own height) * inverse distance.
struct HorizonRow {
  const float* own = nullptr;        // heights of the row's texels
  // Steps between two vertices: height = near[s] + fraction[s] * (far[s] - near[s]).
  const float* const* lerpA = nullptr;
  const float* const* lerpB = nullptr;
  const float* fraction = nullptr;
  const float* lerpInverse = nullptr;
  std::size_t lerpCount = 0;
  // Steps that are one box maximum.
  const float* const* box = nullptr;
  const float* boxInverse = nullptr;
  std::size_t boxCount = 0;

  const LobeSlice* slices = nullptr;  // one per channel
  std::size_t channels = 0;
  float* const* sums = nullptr;       // one row per channel: += F(horizon slope)
  int width = 0;                      // a multiple of kHorizonBlock
};

enum class SimdLevel { Baseline, Avx2, Avx512 };

/// The best that this processor runs. Every level gives the same bits.
SimdLevel bestSimdLevel();

void horizonRow(const HorizonRow& row, SimdLevel level);

}  // namespace lumel::ssbump
