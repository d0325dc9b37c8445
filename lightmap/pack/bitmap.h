// Bit sets in two dimensions, 64 cells to a word: what packing tests for collision.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumel {

/// Row-major bits; cell x of a row is bit x % 64 of its word x / 64. Bits past the width are 0.
class Bitmap {
 public:
  Bitmap() = default;
  Bitmap(int width, int height)
      : width_(width),
        height_(height),
        words_((width + 63) / 64),
        bits_(static_cast<std::size_t>(words_) * static_cast<std::size_t>(height), 0) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int wordsPerRow() const { return words_; }
  bool empty() const { return bits_.empty(); }

  std::uint64_t* row(int y) { return bits_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(words_); }
  const std::uint64_t* row(int y) const { return const_cast<Bitmap*>(this)->row(y); }

  bool get(int x, int y) const { return (row(y)[x >> 6] >> (x & 63)) & 1; }
  void set(int x, int y) { row(y)[x >> 6] |= std::uint64_t{1} << (x & 63); }
  /// Sets cells [x0, x1) of row y.
  void setSpan(int y, int x0, int x1);
  /// Clears cells [x0, x1) of row y.
  void clearSpan(int y, int x0, int x1);

  std::size_t count() const;
  /// Equal for equal bitmaps; nearly always different for others.
  std::uint64_t hash() const;

  /// Calls run(x0, x1) for each maximal run of set cells [x0, x1) of row y, left to right.
  template <class Run>
  void forEachRun(int y, Run&& run) const {
    for (int x = nextSet(y, 0); x < width_;) {
      const int end = nextClear(y, x);
      run(x, end);
      x = nextSet(y, end);
    }
  }

 private:
  int nextSet(int y, int x) const;    // first set cell at or after x, or the width
  int nextClear(int y, int x) const;  // first clear cell at or after x, or the width

  int width_ = 0;
  int height_ = 0;
  int words_ = 0;
  std::vector<std::uint64_t> bits_;
};

/// A quarter turn as in Placement: (x, y) -> (-y, x), moved back into the positive quadrant.
Bitmap quarterTurn(const Bitmap& source);

/// Every cell within `radius` (in the larger of the two axis distances) of a set cell. The result is 2 * radius wider
/// and higher; its cell (x, y) is the source's (x - radius, y - radius).
Bitmap inflate(const Bitmap& source, int radius);

/// Blocks of `block` x `block` cells that hold a set cell; block (0, 0) starts at the source's cell (-originX,
/// -originY).
Bitmap coarsen(const Bitmap& source, int block, int originX, int originY);

}  // namespace lumel
