#include "lightmap/pack/pack_grid.h"

#include <algorithm>
#include <bit>

namespace lumel {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

int floorLog2(int n) { return std::bit_width(static_cast<unsigned>(n)) - 1; }

/// Cells where a square of 2^level cells right and down of the cell lies wholly in the mask.
Bitmap squaresInside(const Bitmap& below, int level) {
  const int half = 1 << (level - 1);
  const int width = below.width() - half;
  const int height = below.height() - half;
  if (width <= 0 || height <= 0) return {};
  Bitmap inside(width, height);
  const auto shifted = [&](const std::uint64_t* row, int i) {
    const int word = i + half / 64;
    const int bit = half % 64;
    const int words = below.wordsPerRow();
    const std::uint64_t low = word < words ? row[word] : 0;
    const std::uint64_t high = word + 1 < words ? row[word + 1] : 0;
    return bit == 0 ? low : (low >> bit) | (high << (64 - bit));
  };
  for (int y = 0; y < height; ++y)
    for (int i = 0; i < inside.wordsPerRow(); ++i) {
      const std::uint64_t* upper = below.row(y);
      const std::uint64_t* lower = below.row(y + half);
      inside.row(y)[i] = upper[i] & lower[i] & shifted(upper, i) & shifted(lower, i);
    }
  return inside;
}

/// Covers what it can of the mask with squares of 2^level cells on a lattice of that step (and at the far ends), where
/// a square covers something new.
void coverWithSquares(const Bitmap& inside, int level, Bitmap& covered, std::vector<Probe>& probes) {
  const int side = 1 << level;
  for (int y = 0; y < inside.height();
       y = y + side < inside.height() || y == inside.height() - 1 ? y + side : inside.height() - 1)
    inside.forEachRun(y, [&](int x0, int x1) {
      for (int x = x0;;) {
        const bool isNew = !covered.get(x, y) || !covered.get(x + side - 1, y) || !covered.get(x, y + side - 1) ||
                           !covered.get(x + side - 1, y + side - 1);
        if (isNew) {
          for (int k = 0; k < side; ++k) covered.setSpan(y + k, x, x + side);
          probes.push_back(
              {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), static_cast<std::uint8_t>(level), true});
        }
        if (x == x1 - 1) break;
        x = std::min(x + side, x1 - 1);
      }
    });
}

/// Runs for what squares left: each uncovered stretch of a row, by runs that stay inside the mask.
void coverWithRuns(const Bitmap& mask, const Bitmap& covered, int maxLevel, std::vector<Probe>& probes) {
  for (int y = 0; y < mask.height(); ++y)
    mask.forEachRun(y, [&](int x0, int x1) {
      for (int x = x0; x < x1;) {
        if (covered.get(x, y)) {
          ++x;
          continue;
        }
        int end = x;
        while (end < x1 && !covered.get(end, y)) ++end;
        const int roundedUp = end - x > 1 ? floorLog2(end - x - 1) + 1 : 0;
        const int level = std::min({roundedUp, floorLog2(x1 - x0), maxLevel});
        const int start = std::min(x, x1 - (1 << level));
        probes.push_back(
            {static_cast<std::int16_t>(start), static_cast<std::int16_t>(y), static_cast<std::uint8_t>(level), false});
        x = start + (1 << level);
      }
    });
}

/// Reorders so that neighbours in the list lie apart: what one probe missed its neighbour is likely to miss too.
void spread(std::span<Probe> probes) {
  const std::size_t count = probes.size();
  if (count < 3) return;
  std::vector<Probe> ordered;
  ordered.reserve(count);
  const std::size_t pot = std::bit_ceil(count);
  const int bits = std::countr_zero(pot);
  for (std::size_t i = 0; i < pot; ++i) {
    std::size_t reversed = 0;
    for (int b = 0; b < bits; ++b) reversed |= ((i >> b) & 1) << (bits - 1 - b);
    if (reversed < count) ordered.push_back(probes[reversed]);
  }
  std::copy(ordered.begin(), ordered.end(), probes.begin());
}

/// The cells around a mask, corners included.
Bitmap rimOf(const Bitmap& mask) {
  Bitmap rim = inflate(mask, 1);
  for (int y = 0; y < mask.height(); ++y)
    mask.forEachRun(y, [&](int x0, int x1) { rim.clearSpan(y + 1, x0 + 1, x1 + 1); });
  return rim;
}

}  // namespace

SearchMask searchMask(const Bitmap& mask) {
  SearchMask search{mask.width(), mask.height(), {}, mask.hash(), rimOf(mask), 0};
  search.rimCells = static_cast<int>(search.rim.count());
  std::vector<Bitmap> inside(1, mask);
  for (int level = 1; level < PackGrid::kSquareLevels; ++level) {
    Bitmap next = squaresInside(inside.back(), level);
    if (next.empty() || next.count() == 0) break;
    inside.push_back(std::move(next));
  }
  Bitmap covered(mask.width(), mask.height());
  for (int level = static_cast<int>(inside.size()) - 1; level >= 1; --level) {
    const std::size_t first = search.probes.size();
    coverWithSquares(inside[static_cast<std::size_t>(level)], level, covered, search.probes);
    spread(std::span(search.probes).subspan(first));
  }
  const std::size_t first = search.probes.size();
  coverWithRuns(mask, covered, PackGrid::kRunLevels - 1, search.probes);
  const std::span<Probe> runs = std::span(search.probes).subspan(first);
  spread(runs);
  std::stable_sort(runs.begin(), runs.end(), [](const Probe& a, const Probe& b) { return a.level > b.level; });
  return search;
}

PackGrid::PackGrid(int width, int height, int border)
    : width_(width), height_(height), border_(border), stride_((width + 63) / 64 + 2) {
  const std::size_t size = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height);
  Level empty(size, 0);
  for (std::size_t i = static_cast<std::size_t>(stride_) - 1; i < size; i += static_cast<std::size_t>(stride_))
    empty[i] = kAll;
  runs_.assign(kRunLevels, empty);
  squares_.assign(kSquareLevels, empty);
  squares_[0].clear();
  freeCells_ = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (int y = 0; y < height; ++y) {
    std::uint64_t* words = row(runs_[0], y);
    for (int i = width / 64; i < stride_; ++i) words[i] = kAll;
    if (width % 64 != 0) words[width / 64] = kAll << (width % 64);
    const bool isBorder = y < border || y >= height - border;
    take(y, 0, isBorder ? width : std::min(border, width));
    take(y, std::max(0, width - border), width);
  }
  updateLevels(0, stride_, 0, height);
}

void PackGrid::take(int y, int x0, int x1) {
  std::uint64_t* words = row(runs_[0], y);
  for (int x = x0; x < x1;) {
    const int bit = x & 63;
    const int count = std::min(64 - bit, x1 - x);
    const std::uint64_t added = (kAll >> (64 - count)) << bit & ~words[x >> 6];
    freeCells_ -= static_cast<std::size_t>(std::popcount(added));
    words[x >> 6] |= added;
    x += count;
  }
}

void PackGrid::updateLevels(int firstWord, int lastWord, int firstRow, int lastRow) {
  // Whether any of a cell and that `half` cells to its right is taken. The last word of a row is all taken, and stays
  // so.
  const auto widen = [](const auto& taken, int half, int begin, int end, std::uint64_t* out) {
    if (half == 64)
      for (int i = begin; i < end; ++i) out[i] = taken(i) | taken(i + 1);
    else
      for (int i = begin; i < end; ++i) out[i] = taken(i) | taken(i) >> half | taken(i + 1) << (64 - half);
  };
  const int end = std::min(lastWord, stride_ - 1);
  for (int level = 1; level < kRunLevels; ++level) {
    const int half = 1 << (level - 1);
    const int begin = std::max(0, firstWord - ((2 * half - 2) / 64 + 1));
    for (int y = firstRow; y < lastRow; ++y) {
      const std::uint64_t* below = row(runs_[static_cast<std::size_t>(level - 1)], y);
      const auto taken = [below](int i) { return below[i]; };
      widen(taken, half, begin, end, row(runs_[static_cast<std::size_t>(level)], y));
    }
  }
  for (int level = 1; level < kSquareLevels; ++level) {
    const int half = 1 << (level - 1);
    const int begin = std::max(0, firstWord - ((2 * half - 2) / 64 + 1));
    const Level& source = level == 1 ? runs_[0] : squares_[static_cast<std::size_t>(level - 1)];
    for (int y = std::max(0, firstRow - 2 * half + 1); y < lastRow; ++y) {
      const std::uint64_t* upper = row(source, y);
      const std::uint64_t* lower = row(source, std::min(y + half, height_ - 1));
      const auto taken = [upper, lower](int i) { return upper[i] | lower[i]; };
      widen(taken, half, begin, end, row(squares_[static_cast<std::size_t>(level)], y));
    }
  }
}

bool PackGrid::findInRow(const SearchMask& mask, int y, FreeRow& free) const {
  const int begin = border_;
  const int end = width_ - border_ - mask.width + 1;  // positions [begin, end)
  std::uint64_t* words = free.words.data();
  int low = begin >> 6;
  int high = (end - 1) >> 6;
  for (int i = low; i <= high; ++i) words[i] = kAll;
  words[low] &= kAll << (begin & 63);
  words[high] &= kAll >> (63 - ((end - 1) & 63));
  for (const Probe& probe : mask.probes) {
    const Level& level = (probe.square ? squares_ : runs_)[probe.level];
    const std::uint64_t* taken = row(level, y + probe.dy) + (probe.dx >> 6);
    const int bit = probe.dx & 63;
    std::uint64_t any = 0;
    if (bit == 0) {
      for (int i = low; i <= high; ++i) any |= words[i] &= ~taken[i];
    } else {
      for (int i = low; i <= high; ++i) any |= words[i] &= ~((taken[i] >> bit) | (taken[i + 1] << (64 - bit)));
    }
    if (any == 0) return false;
    while (words[low] == 0) ++low;
    while (words[high] == 0) --high;
  }
  free.low = low;
  free.high = high;
  return true;
}

/// 64 cells of a row from column x on, which may be -1; what lies off the page counts as taken.
std::uint64_t PackGrid::cellsFrom(int x, int y) const {
  if (y < 0 || y >= height_) return kAll;
  const std::uint64_t* words = row(runs_[0], y);
  if (x < 0) return words[0] << 1 | 1;
  const int word = x >> 6;
  const int bit = x & 63;
  const auto read = [&](int i) { return i < stride_ ? words[i] : kAll; };
  return bit == 0 ? read(word) : read(word) >> bit | read(word + 1) << (64 - bit);
}

int PackGrid::takenUnderRim(const SearchMask& mask, Cell cell) const {
  int sum = 0;
  for (int y = 0; y < mask.rim.height(); ++y) {
    const std::uint64_t* rim = mask.rim.row(y);
    for (int i = 0; i < mask.rim.wordsPerRow(); ++i)
      if (rim[i] != 0) sum += std::popcount(rim[i] & cellsFrom(cell.x - 1 + 64 * i, cell.y - 1 + y));
  }
  return sum;
}

Fit PackGrid::mostContact(const SearchMask& mask, int y, const FreeRow& free) const {
  constexpr int kMostTried = 64;
  Fit best;
  int most = -1;
  int tried = 0;
  const auto consider = [&](int x) {
    ++tried;
    const int taken = takenUnderRim(mask, {x, y});
    if (taken <= most) return;
    most = taken;
    best.cell = {x, y};
  };
  for (int i = free.low; i <= free.high; ++i) {
    // Only the ends of runs of positions have a neighbour at their side.
    for (std::uint64_t bits = free.words[static_cast<std::size_t>(i)]; bits != 0; bits &= bits - 1) {
      const int x = i * 64 + std::countr_zero(bits);
      if (free.at(x - 1) && free.at(x + 1)) continue;
      consider(x);
      if (tried == kMostTried) break;
    }
    if (tried == kMostTried) break;
  }
  best.contact = static_cast<double>(most) / mask.rimCells;
  return best;
}

std::optional<Fit> PackGrid::findLowest(const SearchMask& mask, int firstRow, int lastRow) const {
  if (mask.width > width_ - 2 * border_ || mask.height > height_ - 2 * border_) return std::nullopt;
  FreeRow free;
  free.words.resize(static_cast<std::size_t>(stride_));
  const int last = std::min(lastRow, height_ - border_ - mask.height);
  for (int y = std::max(firstRow, border_); y <= last; ++y)
    if (findInRow(mask, y, free)) return mostContact(mask, y, free);
  return std::nullopt;
}

bool PackGrid::fits(const SearchMask& mask, Cell cell) const {
  if (cell.x < border_ || cell.y < border_) return false;
  if (cell.x > width_ - border_ - mask.width || cell.y > height_ - border_ - mask.height) return false;
  for (const Probe& probe : mask.probes) {
    const Level& level = (probe.square ? squares_ : runs_)[probe.level];
    const int x = cell.x + probe.dx;
    if ((row(level, cell.y + probe.dy)[x >> 6] >> (x & 63)) & 1) return false;
  }
  return true;
}

void PackGrid::insert(const Bitmap& taken, int x, int y) {
  const int firstRow = std::max(0, y);
  const int lastRow = std::min(height_, y + taken.height());
  const int firstCell = std::max(0, x);
  const int lastCell = std::min(width_, x + taken.width());
  if (firstRow >= lastRow || firstCell >= lastCell) return;
  for (int cellY = firstRow; cellY < lastRow; ++cellY)
    taken.forEachRun(cellY - y, [&](int x0, int x1) { take(cellY, std::max(0, x0 + x), std::min(width_, x1 + x)); });
  updateLevels(firstCell >> 6, ((lastCell - 1) >> 6) + 1, firstRow, lastRow);
}

}  // namespace lumel
