// The inner loop of the horizon back end: some rows of texels, one azimuth, in SIMD for the processor at hand.
#pragma once

#include <cstddef>
#include <span>

#include "ssbump/lobe.h"

namespace lumel::ssbump {

/// Texels that the kernel handles at once: rows are padded to a multiple of this.
inline constexpr int kHorizonBlock = 64;

/// A slope rising by this, a quarter of a degree, is not looked for any more: at worst, missed all around, 0.002 of the
/// visibility; measured, less than 1e-4.
inline constexpr float kSlopeThatMatters = 0.004f;

/// Steps that begin at one distance. They count for a texel only if the highest point of the field could raise its
/// slope there by kSlopeThatMatters: (highest - own height) * inverse - slope exceeds that.
struct StepGroup {
  std::size_t end = 0;  // one past the group's last step
  float inverse = 0;    // 1 / the least distance of its steps
};

/// One azimuth of one row. Slopes are (height at the step - own height) * inverse distance.
struct HorizonRow {
  const float* own = nullptr;  // heights of the row's texels
  // Steps between two vertices: height = near[s] + fraction[s] * (far[s] - near[s]).
  const float* const* lerpA = nullptr;
  const float* const* lerpB = nullptr;
  const float* fraction = nullptr;
  const float* lerpInverse = nullptr;
  const StepGroup* lerpGroups = nullptr;
  std::size_t lerpGroupCount = 0;
  // Steps that are one box maximum.
  const float* const* box = nullptr;
  const float* boxInverse = nullptr;
  const StepGroup* boxGroups = nullptr;
  std::size_t boxGroupCount = 0;
  float highest = 0;  // of the whole field

  const LobeSlice* slices = nullptr;  // one per channel
  std::size_t channels = 0;
  float* const* sums = nullptr;  // one row per channel: += F(horizon slope)
  int width = 0;                 // a multiple of kHorizonBlock
};

enum class SimdLevel { Baseline, Avx2, Avx512 };

/// The best that this processor runs. Every level gives the same bits.
SimdLevel bestSimdLevel();

/// All rows block by block, so that the rows' common neighbourhood stays in the first cache. Rows of one azimuth, one
/// width, one set of groups and lobes.
void horizonRows(std::span<const HorizonRow> rows, SimdLevel level);

}  // namespace lumel::ssbump
