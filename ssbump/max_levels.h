// Box maxima of a height field, kept as rows that the horizon kernel can load at any shift: what makes a far occluder
// cost one load whatever its distance.
#pragma once

#include <span>
#include <vector>

#include "ssbump/height_field.h"

namespace lumel::ssbump {

/// A rectangle of texels; may reach beyond the map, where it wraps.
struct TexelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

/// What lies outside a map that does not wrap: lower than any height, and still safe to interpolate.
inline constexpr float kNoSurface = -1e30f;

/// Maxima over groups of 8, 16, 32, ... whole rows, so that a tall box costs a few rows: a quarter of the map's memory.
class RowMaxima {
 public:
  explicit RowMaxima(const HeightField& field);
  const HeightField& field() const { return field_; }

  /// out[i] = maximum over rows [y0, y1) of column x0 + i, wrapped or kNoSurface outside.
  void band(int y0, int y1, int x0, std::span<float> out) const;

 private:
  static constexpr int kFirstShift = 3;
  const HeightField& field_;
  std::vector<std::vector<float>> groups_;  // [k]: rows of 2^(k + kFirstShift) map rows
};

/// Which way a level's windows are long.
enum class Along { X, Y };

/// One level around a tile: entry (x, y) is the maximum over a window of `length` texels along one axis and a quarter
/// of that across, [x - wx/2, x + wx - wx/2) and y likewise. Thin windows: over a random field a strip beside the slice
/// has the statistics of the slice itself, a square would reach for what lies beside it; and joints that run along an
/// axis stay open. Every column is stored, and every stride-th row, at map rows that are multiples of stride: a tile's
/// result does not depend on where tiles begin.
class MaxLevel {
 public:
  /// Covers offsets up to `range` texels from the tile, and `padding` more columns on the right. `length` is 1 (the
  /// heights themselves) or a power of two.
  MaxLevel(const RowMaxima& rows, const TexelRect& tile, int length, Along along, int range, int padding);

  /// Width of a window across its length.
  static int across(int length) { return length < 4 ? 1 : length / 4; }

  /// Pointer to column x of the stored row nearest to y; valid for the tile's width + padding from there.
  const float* at(int x, int y) const {
    const std::ptrdiff_t stored = ((y + (1 << shift_ >> 1)) >> shift_) - firstRow_;
    return data_.data() + stored * width_ + (x - x0_);
  }
  /// From a pointer of the heights themselves (length 1) to the one a row below.
  std::ptrdiff_t rowStride() const { return width_; }

 private:
  int shift_;  // log2 of the stride
  int x0_, width_, firstRow_;
  std::vector<float> data_;
};

}  // namespace lumel::ssbump
