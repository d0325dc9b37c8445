#include "ssbump/max_levels.h"

#include <algorithm>
#include <bit>

#include "scene/parallel.h"

namespace lumel::ssbump {
namespace {

int wrapIndex(int i, int size) {
  i %= size;
  return i < 0 ? i + size : i;
}

/// out[i] = max(out[i], row[x0 + i]) with the row repeated, or left alone where a row that does not wrap has ended.
void maxRow(const float* row, int width, bool wrap, int x0, std::span<float> out) {
  const int count = static_cast<int>(out.size());
  for (int i = 0; i < count;) {
    const int x = wrap ? wrapIndex(x0 + i, width) : x0 + i;
    if (x < 0) {
      i += std::min(count - i, -x);
      continue;
    }
    if (x >= width) return;
    const int run = std::min(count - i, width - x);
    for (int k = 0; k < run; ++k)
      out[static_cast<std::size_t>(i + k)] = std::max(out[static_cast<std::size_t>(i + k)], row[x + k]);
    i += run;
  }
}

}  // namespace

RowMaxima::RowMaxima(const HeightField& field) : field_(field) {
  const auto width = static_cast<std::size_t>(field.width);
  for (int shift = kFirstShift; (field.height >> shift) >= 1; ++shift) {
    const auto rows = static_cast<std::size_t>(field.height >> shift);  // whole groups only
    std::vector<float> group(rows * width);
    const bool first = groups_.empty();
    parallelFor(rows, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        float* out = &group[r * width];
        const std::size_t parts = first ? std::size_t{1} << kFirstShift : 2;
        for (std::size_t part = 0; part < parts; ++part) {
          const float* in =
              first ? field.row(static_cast<int>(r * parts + part)) : &groups_.back()[(r * parts + part) * width];
          if (part == 0)
            std::copy(in, in + width, out);
          else
            for (std::size_t x = 0; x < width; ++x) out[x] = std::max(out[x], in[x]);
        }
      }
    });
    groups_.push_back(std::move(group));
  }
}

void RowMaxima::band(int y0, int y1, int x0, std::span<float> out) const {
  std::fill(out.begin(), out.end(), kNoSurface);
  const int height = field_.height, width = field_.width;
  if (field_.wrap && y1 - y0 >= height) {
    y0 = 0;
    y1 = height;
  }
  if (!field_.wrap) {
    y0 = std::max(y0, 0);
    y1 = std::min(y1, height);
  }
  while (y0 < y1) {
    const int y = field_.wrap ? wrapIndex(y0, height) : y0;
    int shift = kFirstShift + static_cast<int>(groups_.size()) - 1;
    while (shift >= kFirstShift &&
           ((y & ((1 << shift) - 1)) != 0 || y + (1 << shift) > height || y0 + (1 << shift) > y1))
      --shift;
    if (shift < kFirstShift) {
      maxRow(field_.row(y), width, field_.wrap, x0, out);
      ++y0;
    } else {
      const auto& group = groups_[static_cast<std::size_t>(shift - kFirstShift)];
      maxRow(&group[static_cast<std::size_t>(y >> shift) * static_cast<std::size_t>(width)], width, field_.wrap, x0,
             out);
      y0 += 1 << shift;
    }
  }
}

MaxLevel::MaxLevel(const RowMaxima& rows, const TexelRect& tile, int length, Along along, int range, int padding)
    : shift_(std::countr_zero(static_cast<unsigned>(std::max(1, along == Along::X ? across(length) / 2 : length / 4)))),
      x0_(tile.x - range),
      width_(tile.width + 2 * range + padding) {
  const int windowX = along == Along::X ? length : across(length),
            windowY = along == Along::X ? across(length) : length;
  firstRow_ = (tile.y - range) >> shift_;
  const int lastRow = ((tile.y + tile.height + range) >> shift_) + 1;
  const auto count = static_cast<std::size_t>(lastRow - firstRow_ + 1);
  const auto width = static_cast<std::size_t>(width_);
  data_.resize(count * width);
  parallelFor(count, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<float> wide(width + static_cast<std::size_t>(windowX - 1));
    for (std::size_t r = begin; r < end; ++r) {
      const int y = ((firstRow_ + static_cast<int>(r)) << shift_) - windowY / 2;
      rows.band(y, y + windowY, x0_ - windowX / 2, wide);
      for (int step = 1; step < windowX; step *= 2)
        for (std::size_t i = 0; i + static_cast<std::size_t>(step) < wide.size(); ++i)
          wide[i] = std::max(wide[i], wide[i + static_cast<std::size_t>(step)]);
      std::copy(wide.begin(), wide.begin() + static_cast<std::ptrdiff_t>(width), &data_[r * width]);
    }
  });
}

}  // namespace lumel::ssbump
