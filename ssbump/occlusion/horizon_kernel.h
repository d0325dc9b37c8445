// The inner loops of the horizon back end, one azimuth at a time, in SIMD for the processor at hand.
#pragma once

#include <cstddef>
#include <span>

#include "ssbump/occlusion/lobe.h"

namespace lumel::ssbump {

/// Rows that the kernel walks are padded to a multiple of this.
inline constexpr int kHorizonBlock = 64;
/// So are rows of cells, and a row of cells can be read so far past its end.
inline constexpr int kCellBlock = 32;

/// A point on the edge between two vertices: height = a + fraction * (b - a).
struct NearStep {
  std::ptrdiff_t a = 0, b = 0;  // offsets of the two vertices from the texel's own
  float fraction = 0, inverseDistance = 0;
};

/// The far horizon of cells of texels. Each slope (H - h) / d falls linearly with the own height h, so the horizon, the
/// highest of them, is convex in h: known at a cell's lowest and highest texel, the chord between is at most too high,
/// and exact wherever one occluder rules.
struct FarCells {
  int rows = 0, columns = 0;  // columns: a multiple of kCellBlock
  const float* lowest = nullptr;
  const float* highest = nullptr;
  std::ptrdiff_t heightStride = 0;
  // Steps: the maximum that cell (0, 0) sees; the cells a row below and to the right see those stride and 1 further.
  std::span<const float* const> windows;
  std::ptrdiff_t windowStride = 0;
  std::span<const float> inverseDistances;
  // What lies farther still, of cells as large or twice as large; null: nothing.
  const FarCells* farther = nullptr;
  bool fartherIsTwice = false;
  // Out, rows x columns: the slope at the lowest texel, and its change per height.
  float* slopes = nullptr;
  float* changes = nullptr;
};

/// One azimuth of some rows of texels. Slopes are (height at the step - own height) * inverse distance.
struct NearSlice {
  FarCells texels;                   // where cells are texels; their lowest and highest and what is out are not used
  std::span<const NearStep> steps;   // nearest first
  std::span<const LobeSlice> lobes;  // one per channel
};

/// One row of texels.
struct NearRow {
  const float* own = nullptr;         // heights
  float highest = 0;                  // at least that of any step of the row's texels
  std::span<const NearSlice> slices;  // a few neighbouring azimuths: their sums are fetched once
  float* const* sums = nullptr;       // one row per channel: += F(horizon slope)
  int row = 0, column = 0;            // of the first texel, among the slices' texels
  int width = 0;                      // a multiple of kHorizonBlock
};

enum class SimdLevel { Baseline, Avx2, Avx512 };

/// The best that this processor runs. Every level gives the same bits.
SimdLevel bestSimdLevel();

void farCells(const FarCells& cells, SimdLevel level);

/// All rows block by block, so that the rows' common neighbourhood stays in the L1 cache. Rows of one width.
void nearRows(std::span<const NearRow> rows, SimdLevel level);

}  // namespace lumel::ssbump
