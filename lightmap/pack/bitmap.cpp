#include "lightmap/pack/bitmap.h"

#include <algorithm>
#include <bit>

namespace lumel {
namespace {

/// Bits [from, 64) of a word.
std::uint64_t bitsFrom(int from) { return ~std::uint64_t{0} << from; }

/// Bits [0, to) of a word, to in 1..64.
std::uint64_t bitsUpTo(int to) { return ~std::uint64_t{0} >> (64 - to); }

/// Calls change(word, bits) for the words of cells [x0, x1), with the bits that are meant.
template <class Change>
void forEachWord(std::uint64_t* words, int x0, int x1, Change&& change) {
  if (x0 >= x1) return;
  const int first = x0 >> 6;
  const int last = (x1 - 1) >> 6;
  for (int i = first; i <= last; ++i) {
    std::uint64_t bits = ~std::uint64_t{0};
    if (i == first) bits &= bitsFrom(x0 & 63);
    if (i == last) bits &= bitsUpTo(((x1 - 1) & 63) + 1);
    change(words[i], bits);
  }
}

}  // namespace

void Bitmap::setSpan(int y, int x0, int x1) {
  forEachWord(row(y), x0, x1, [](std::uint64_t& word, std::uint64_t bits) { word |= bits; });
}

void Bitmap::clearSpan(int y, int x0, int x1) {
  forEachWord(row(y), x0, x1, [](std::uint64_t& word, std::uint64_t bits) { word &= ~bits; });
}

std::size_t Bitmap::count() const {
  std::size_t sum = 0;
  for (const std::uint64_t word : bits_) sum += static_cast<std::size_t>(std::popcount(word));
  return sum;
}

std::uint64_t Bitmap::hash() const {
  std::uint64_t h = 0x9e3779b97f4a7c15u;
  const auto mix = [&](std::uint64_t value) {
    h ^= value;
    h *= 0xff51afd7ed558ccdu;
    h ^= h >> 32;
  };
  mix(static_cast<std::uint64_t>(width_));
  mix(static_cast<std::uint64_t>(height_));
  for (const std::uint64_t word : bits_) mix(word);
  return h;
}

int Bitmap::nextSet(int y, int x) const {
  const std::uint64_t* words = row(y);
  for (int i = x >> 6; i < words_; ++i) {
    const std::uint64_t word = i == x >> 6 ? words[i] & bitsFrom(x & 63) : words[i];
    if (word != 0) return i * 64 + std::countr_zero(word);
  }
  return width_;
}

int Bitmap::nextClear(int y, int x) const {
  const std::uint64_t* words = row(y);
  for (int i = x >> 6; i < words_; ++i) {
    const std::uint64_t word = i == x >> 6 ? ~words[i] & bitsFrom(x & 63) : ~words[i];
    if (word != 0) return std::min(width_, i * 64 + std::countr_zero(word));
  }
  return width_;
}

Bitmap quarterTurn(const Bitmap& source) {
  Bitmap turned(source.height(), source.width());
  for (int y = 0; y < source.height(); ++y)
    source.forEachRun(y, [&](int x0, int x1) {
      for (int x = x0; x < x1; ++x) turned.set(source.height() - 1 - y, x);
    });
  return turned;
}

Bitmap inflate(const Bitmap& source, int radius) {
  const int side = 2 * radius;
  Bitmap wide(source.width() + side, source.height());
  for (int y = 0; y < source.height(); ++y)
    source.forEachRun(y, [&](int x0, int x1) { wide.setSpan(y, x0, x1 + side); });
  Bitmap inflated(wide.width(), source.height() + side);
  for (int y = 0; y < wide.height(); ++y)
    for (int k = 0; k <= side; ++k)
      for (int i = 0; i < wide.wordsPerRow(); ++i) inflated.row(y + k)[i] |= wide.row(y)[i];
  return inflated;
}

Bitmap coarsen(const Bitmap& source, int block, int originX, int originY) {
  Bitmap coarse((source.width() + originX + block - 1) / block, (source.height() + originY + block - 1) / block);
  for (int y = 0; y < source.height(); ++y)
    source.forEachRun(y, [&](int x0, int x1) {
      coarse.setSpan((y + originY) / block, (x0 + originX) / block, (x1 - 1 + originX) / block + 1);
    });
  return coarse;
}

}  // namespace lumel
