#include "ssbump/occlusion/max_levels.h"

#include <algorithm>

#include "scene/base/parallel.h"

namespace lumel::ssbump {
namespace {

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

/// The cells at the edge of a map that does not tile may have their centre beyond it: the edge goes on to their end.
/// `end` is the place in `row` behind the map's last column.
void extendToCell(std::vector<float>& row, int end, int count) {
  const int size = static_cast<int>(row.size());
  if (end < 1 || end > size) return;
  for (int i = end; i < std::min(size, end + count); ++i)
    row[static_cast<std::size_t>(i)] = row[static_cast<std::size_t>(end - 1)];
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

NearHeights::NearHeights(const RowMaxima& rows, const TexelRect& tile, int range)
    : x0_(tile.x - range), y0_(tile.y - range), width_(tile.width + 2 * range) {
  const auto count = static_cast<std::size_t>(tile.height + 2 * range), width = static_cast<std::size_t>(width_);
  data_.resize(count * width);
  parallelFor(count, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const int y = y0_ + static_cast<int>(r);
      const std::span<float> row{&data_[r * width], width};
      rows.band(y, y + 1, x0_, row);
      for (float& h : row) h -= rows.field().lowest;
    }
  });
}

CellHeights::CellHeights(const HeightField& field, const TexelRect& tile, int cell, int columns)
    : x0_(tile.x), y0_(tile.y), cell_(cell), width_((tile.width + cell - 1) / cell + columns) {
  const auto rows = static_cast<std::size_t>((tile.height + cell - 1) / cell), width = static_cast<std::size_t>(width_);
  lowest_.assign(rows * width, 0.0f);
  highest_.assign(rows * width, 0.0f);
  const int right = std::min(tile.x + tile.width, field.width);
  parallelFor(rows, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<float> low(static_cast<std::size_t>(tile.width)), high(low.size());
    for (std::size_t r = begin; r < end; ++r) {
      const int top = y0_ + static_cast<int>(r) * cell, bottom = std::min(top + cell, field.height);
      if (top >= bottom) continue;
      const auto count = static_cast<std::size_t>(right - x0_);
      std::copy_n(field.row(top) + x0_, count, low.begin());
      std::copy_n(field.row(top) + x0_, count, high.begin());
      for (int y = top + 1; y < bottom; ++y) {
        const float* row = field.row(y) + x0_;
        for (std::size_t i = 0; i < count; ++i) {
          low[i] = std::min(low[i], row[i]);
          high[i] = std::max(high[i], row[i]);
        }
      }
      for (std::size_t i = 0, c = r * width; i < count; i += static_cast<std::size_t>(cell), ++c) {
        const auto first = static_cast<std::ptrdiff_t>(i),
                   last = static_cast<std::ptrdiff_t>(std::min(count, i + static_cast<std::size_t>(cell)));
        lowest_[c] = *std::min_element(low.begin() + first, low.begin() + last) - field.lowest;
        highest_[c] = *std::max_element(high.begin() + first, high.begin() + last) - field.lowest;
      }
    }
  });
}

FarLevel::FarLevel(const RowMaxima& rows, const TexelRect& tile, const WindowGrid& grid, Along along, int range,
                   int padding)
    : cell_(grid.cell),
      spacingX_(along == Along::X ? grid.spacingAlong() : grid.spacingAcross()),
      spacingY_(along == Along::X ? grid.spacingAcross() : grid.spacingAlong()),
      phases_(cell_ / spacingX_) {
  const int windowX = along == Along::X ? grid.length : grid.across(),
            windowY = along == Along::X ? grid.across() : grid.length;
  const HeightField& field = rows.field();
  const auto up = [&](int length) { return (length + cell_ - 1) / cell_ * cell_; };
  x0_ = tile.x - up(range);
  y0_ = tile.y - up(range);
  width_ = (up(tile.width) + 2 * up(range)) / cell_ + 1;
  const int lastRow = (tile.height + up(range) + range) / spacingY_ + 1;
  const auto count = static_cast<std::size_t>(lastRow + 1), width = static_cast<std::size_t>(width_),
             phaseCount = static_cast<std::size_t>(phases_), cell = static_cast<std::size_t>(cell_);
  data_.resize(count * phaseCount * width + static_cast<std::size_t>(padding));
  const std::size_t columns = width * cell;
  parallelFor(count, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<float> wide(columns + static_cast<std::size_t>(windowX - 1));
    for (std::size_t r = begin; r < end; ++r) {
      const int y = y0_ + static_cast<int>(r) * spacingY_ - windowY / 2;
      const bool below = !field.wrap && y >= field.height && y < up(field.height);
      rows.band(below ? field.height - 1 : y, y + windowY, x0_ - windowX / 2, wide);
      if (!field.wrap) extendToCell(wide, field.width - (x0_ - windowX / 2), up(field.width) - field.width);
      for (int step = 1; step < windowX; step *= 2)
        for (std::size_t i = 0; i + static_cast<std::size_t>(step) < wide.size(); ++i)
          wide[i] = std::max(wide[i], wide[i + static_cast<std::size_t>(step)]);
      for (std::size_t phase = 0; phase < phaseCount; ++phase) {
        float* out = &data_[(r * phaseCount + phase) * width];
        const float* in = &wide[phase * static_cast<std::size_t>(spacingX_)];
        for (std::size_t i = 0; i < width; ++i) out[i] = in[i * cell] - rows.field().lowest;
      }
    }
  });
}

}  // namespace lumel::ssbump
