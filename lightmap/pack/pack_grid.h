// One atlas page while it is being packed: which cells are taken, and the search for the first place that a mask fits.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lightmap/pack/bitmap.h"

namespace lumel {

/// A question that a mask asks of a page: is a cell taken in a run of 2^level cells that starts at (dx, dy) from the
/// mask's corner, or (square) in 2^level such rows?
struct Probe {
  std::int16_t dx = 0;
  std::int16_t dy = 0;
  std::uint8_t level = 0;
  bool square = false;
};

/// A bitmap in the form that a page searches for: probes that together ask for exactly the mask's set cells, the ones
/// that rule out most first.
struct SearchMask {
  int width = 0;
  int height = 0;
  std::vector<Probe> probes;
  std::uint64_t hash = 0;  // of the bitmap
  Bitmap rim;              // the cells around the mask; its cell (x, y) is the mask's (x - 1, y - 1)
  int rimCells = 0;
};

SearchMask searchMask(const Bitmap& mask);

struct Cell {
  int x = 0;
  int y = 0;
};

/// A place where a mask fits, and how much of its rim lies on taken cells (0 to 1): what touches leaves no gaps.
struct Fit {
  Cell cell;
  double contact = 0.0;
};

/// Occupancy with summaries: for each level k, and each cell, whether any of the 2^k cells to its right, or of the
/// square of 2^k cells right and down of it, is taken. The test of one row of positions for one probe is then two
/// words read and shifted per 64 positions, whatever the size of the mask.
class PackGrid {
 public:
  /// Positions keep `border` cells away from each side.
  PackGrid(int width, int height, int border);

  int width() const { return width_; }
  int height() const { return height_; }

  /// The lowest row y in [firstRow, lastRow] where the mask touches no taken cell, and in it the place with the most
  /// contact (of the first 64 that have something beside them; the leftmost of equals).
  std::optional<Fit> findLowest(const SearchMask& mask, int firstRow, int lastRow) const;

  /// Whether the mask touches no taken cell there. Any cell may be asked for.
  bool fits(const SearchMask& mask, Cell cell) const;

  /// Takes the cells of `taken` with its corner at (x, y); parts outside the page are cut off.
  void insert(const Bitmap& taken, int x, int y);

  std::size_t freeCells() const { return freeCells_; }

 private:
  static constexpr int kRunLevels = 8;     // runs up to 2^7 cells
  static constexpr int kSquareLevels = 7;  // squares up to 2^6 cells
  friend SearchMask searchMask(const Bitmap& mask);

  using Level = std::vector<std::uint64_t>;
  std::uint64_t* row(Level& level, int y) const {
    return level.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_);
  }
  const std::uint64_t* row(const Level& level, int y) const {
    return level.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_);
  }
  /// Positions of a row where a mask fits: bits of the words [low, high].
  struct FreeRow {
    std::vector<std::uint64_t> words;
    int low = 0;
    int high = 0;
    bool at(int x) const {
      return x >> 6 >= low && x >> 6 <= high && ((words[static_cast<std::size_t>(x >> 6)] >> (x & 63)) & 1) != 0;
    }
  };
  void take(int y, int x0, int x1);
  void updateLevels(int firstWord, int lastWord, int firstRow, int lastRow);
  bool findInRow(const SearchMask& mask, int y, FreeRow& free) const;
  Fit mostContact(const SearchMask& mask, int y, const FreeRow& free) const;
  int takenUnderRim(const SearchMask& mask, Cell cell) const;
  std::uint64_t cellsFrom(int x, int y) const;

  int width_;
  int height_;
  int border_;
  int stride_;  // words per row, with two words of taken cells past the width
  std::size_t freeCells_ = 0;
  std::vector<Level> runs_;     // [0] is the occupancy itself
  std::vector<Level> squares_;  // [0] unused: one cell is runs_[0]
};

}  // namespace lumel
