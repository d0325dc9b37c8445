// Heights prepared for horizons: rows that can be loaded at any shift, cells of texels that share their far horizon,
// and box maxima that make a far occluder cost one load whatever its distance.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "ssbump/occlusion/height_field.h"

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

/// The heights of a tile and of `range` texels around it, wrapped or kNoSurface outside.
class NearHeights {
 public:
  NearHeights(const RowMaxima& rows, const TexelRect& tile, int range);
  const float* at(int x, int y) const { return data_.data() + (y - y0_) * rowStride() + (x - x0_); }
  std::ptrdiff_t rowStride() const { return width_; }

 private:
  int x0_, y0_, width_;
  std::vector<float> data_;
};

/// The lowest and the highest texel of each cell of `cell` x `cell` texels. Cells lie at multiples of their size in the
/// map, and `tile` begins at one. What a cell has outside the map does not count; a cell wholly outside is 0.
class CellHeights {
 public:
  /// Rows are at least `columns` cells long from any cell of the tile: what lies past the tile is 0.
  CellHeights(const HeightField& field, const TexelRect& tile, int cell, int columns);
  /// These return the row of cells from the one whose corner is the texel (x, y).
  const float* lowest(int x, int y) const { return lowest_.data() + index(x, y); }
  const float* highest(int x, int y) const { return highest_.data() + index(x, y); }
  std::ptrdiff_t rowStride() const { return width_; }

 private:
  std::ptrdiff_t index(int x, int y) const {
    return static_cast<std::ptrdiff_t>((y - y0_) / cell_) * width_ + (x - x0_) / cell_;
  }
  int x0_, y0_, cell_, width_;
  std::vector<float> lowest_, highest_;
};

/// Which way a level's windows are long.
enum class Along { X, Y };

/// The windows of a level and where they are kept.
struct WindowGrid {
  int length = 1;  // texels along the axis: a power of two
  int cell = 1;    // what asks for them lies this far apart: a power of two, at most the length
  /// Width across the axis. Thin windows: over a random field a strip beside the slice has the statistics of the slice
  /// itself, a square would reach for what lies beside it; and joints that run along an axis stay open.
  int across() const { return length < 4 ? 1 : length / 4; }
  /// Between the windows that are kept.
  int spacingAlong() const { return cell; }
  int spacingAcross() const { return cell < across() ? cell : across(); }
};

/// Maxima around a tile: entry (x, y) is the maximum over [x - wx/2, x + wx - wx/2) and y likewise. Entries lie at
/// multiples of the grid's spacings in the map, so a tile's result does not depend on where tiles begin. Those that are
/// a cell apart along x lie side by side, for vector loads.
class FarLevel {
 public:
  /// Covers offsets up to `range` texels from the tile. The tile begins at a multiple of the cell; behind every entry
  /// `padding` more can be read. Where a map does not tile, its last column and row go on to the end of their cells.
  FarLevel(const RowMaxima& rows, const TexelRect& tile, const WindowGrid& grid, Along along, int range, int padding);

  /// The entry at (x, y), multiples of the spacings; the next float is the entry a cell to the right.
  const float* at(int x, int y) const {
    const int column = x - x0_, row = (y - y0_) / spacingY_;
    return data_.data() + (static_cast<std::ptrdiff_t>(row) * phases_ + column % cell_ / spacingX_) * width_ +
           column / cell_;
  }
  /// Returns the distance from an entry to the one a cell below.
  std::ptrdiff_t cellRowStride() const { return static_cast<std::ptrdiff_t>(cell_ / spacingY_) * phases_ * width_; }

 private:
  int cell_, spacingX_, spacingY_;
  int phases_;           // entries along x per cell: each makes a row of its own
  int x0_, y0_, width_;  // width_: entries of one phase in a row
  std::vector<float> data_;
};

}  // namespace lumel::ssbump
