#include "lightmap/denoise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/check.h"
#include "scene/each_cpu.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

constexpr std::size_t kMaps = 4;
constexpr std::size_t kColors = 3 * kMaps;
constexpr int kPatch = 1;  // patches of 3 x 3 texels are compared
constexpr int kHalo = kDenoiseRadius + kPatch;
/// Tiles that stay in a core's cache while all pairs are added, in strips that bound what is kept of changed rows.
constexpr std::size_t kTileRows = 32;
constexpr std::size_t kTileColumns = 256;
constexpr std::size_t kStripRows = 4 * kTileRows;

/// Variance of the luminance of an RNM map over that of the flat map: 1.7 to 2 measured over a level and a box.
constexpr float kRnmVariance = 2.0f;
/// Patches further apart than so many times their noise (as variance, beyond what noise explains) share nothing.
constexpr float kLargestDistance = 4.0f;
/// Noise below this share of a texel's light is rounding.
constexpr float kLeastRelativeError = 1e-5f;

/// Part of a page, with a margin around it, one plane per quantity so that loops along rows vectorise.
struct Tile {
  std::size_t rows = 0;
  std::size_t columns = 0;
  std::size_t stride = 0;
  std::vector<std::uint32_t> charts;
  std::vector<float> variance;
  std::array<std::vector<float>, kMaps> luminances;
  std::array<std::vector<float>, kColors> colors;

  std::size_t at(std::ptrdiff_t row, std::ptrdiff_t x) const {
    return static_cast<std::size_t>((row + kHalo) * static_cast<std::ptrdiff_t>(stride) + x + kHalo);
  }
};

/// The rows of the maps as they were: those above `firstKept` + kHalo have changed, of the last of them `kept` holds
/// copies.
struct Rows {
  std::array<Image*, kMaps> maps;
  std::array<std::vector<float>, kMaps> kept;  // kHalo rows
  std::ptrdiff_t firstKept = -kHalo;

  std::size_t rowSize() const { return static_cast<std::size_t>(maps[0]->width) * 3; }
  const float* row(std::size_t map, std::ptrdiff_t y) const {
    if (y >= firstKept + kHalo) return maps[map]->pixels.data() + static_cast<std::size_t>(y) * rowSize();
    return kept[map].data() + static_cast<std::size_t>(y - firstKept) * rowSize();
  }
  /// Before rows up to `last`, all of them after those that are kept, change. They must be at least kHalo.
  void keepBefore(std::ptrdiff_t last) {
    firstKept = last - kHalo;
    for (std::size_t m = 0; m < kMaps; ++m) {
      const float* from = maps[m]->pixels.data() + static_cast<std::size_t>(firstKept) * rowSize();
      kept[m].assign(from, from + kHalo * rowSize());
    }
  }
};

/// What the texels of a page are judged by.
struct Judged {
  std::span<const std::uint32_t> chartIds;
  std::span<const float> errors;
  std::size_t stride;
};

Tile readTile(const Rows& from, const Judged& judged, std::ptrdiff_t firstRow, std::size_t rows,
              std::ptrdiff_t firstColumn, std::size_t columns) {
  const std::ptrdiff_t width = from.maps[0]->width;
  const std::ptrdiff_t height = from.maps[0]->height;
  Tile tile;
  tile.rows = rows;
  tile.columns = columns;
  tile.stride = columns + 2 * kHalo;
  const std::size_t count = tile.stride * (rows + 2 * kHalo);
  tile.charts.assign(count, 0);
  tile.variance.assign(count, std::numeric_limits<float>::min());
  for (auto& plane : tile.luminances) plane.assign(count, 0.0f);
  for (auto& plane : tile.colors) plane.assign(count, 0.0f);
  const std::ptrdiff_t left = std::max<std::ptrdiff_t>(0, firstColumn - kHalo);
  const std::ptrdiff_t right = std::min(width, firstColumn + static_cast<std::ptrdiff_t>(columns) + kHalo);
  for (std::ptrdiff_t row = -kHalo; row < static_cast<std::ptrdiff_t>(rows) + kHalo; ++row) {
    const std::ptrdiff_t y = firstRow + row;
    if (y < 0 || y >= height) continue;
    std::array<const float*, kMaps> pixels{};
    for (std::size_t m = 0; m < kMaps; ++m) pixels[m] = from.row(m, y);
    for (std::ptrdiff_t x = left; x < right; ++x) {
      const auto source = static_cast<std::size_t>(y * width + x);
      if (judged.chartIds[source] == 0) continue;
      const std::size_t to = tile.at(row, x - firstColumn);
      tile.charts[to] = judged.chartIds[source];
      for (std::size_t m = 0; m < kMaps; ++m) {
        const float* pixel = pixels[m] + x * 3;
        for (std::size_t c = 0; c < 3; ++c) tile.colors[m * 3 + c][to] = pixel[c];
        tile.luminances[m][to] = luminance(Vec3(pixel[0], pixel[1], pixel[2]));
      }
      const float error = std::max(judged.errors[source * judged.stride], kLeastRelativeError * tile.luminances[0][to]);
      tile.variance[to] += error * error;
    }
  }
  return tile;
}

/// Scratch of one row of differences: 1 and the distance where both texels are of one chart, else 0 and 0.
struct Differences {
  std::vector<float> distance;
  std::vector<float> comparable;
};

/// Squared difference of texels `shift` apart, less what their noise explains, relative to that noise; the mean over
/// the four maps. Each entry is the sum over a row of the patch. Entries x of [0, width).
void differencesOfRow(const Tile& tile, std::ptrdiff_t row, std::ptrdiff_t shift, std::size_t width, Differences& raw,
                      Differences& out) {
  const std::size_t first = tile.at(row, -kPatch);
  const std::size_t count = width + 2 * kPatch;
  const std::uint32_t* chart = tile.charts.data() + first;
  const float* variance = tile.variance.data() + first;
  std::array<const float*, kMaps> light{};
  for (std::size_t m = 0; m < kMaps; ++m) light[m] = tile.luminances[m].data() + first;
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::ptrdiff_t>(k);
    const float noise = variance[i] + variance[i + shift];
    const float d0 = light[0][i] - light[0][i + shift];
    const float d1 = light[1][i] - light[1][i + shift];
    const float d2 = light[2][i] - light[2][i + shift];
    const float d3 = light[3][i] - light[3][i + shift];
    const float squares = d0 * d0 + (d1 * d1 + d2 * d2 + d3 * d3) * (1.0f / kRnmVariance);
    const bool same = chart[i] != 0 && chart[i] == chart[i + shift];
    raw.distance[k] = same ? squares / (static_cast<float>(kMaps) * noise) - 1.0f : 0.0f;
    raw.comparable[k] = same ? 1.0f : 0.0f;
  }
  for (std::size_t x = 0; x < width; ++x) {
    out.distance[x] = raw.distance[x] + raw.distance[x + 1] + raw.distance[x + 2];
    out.comparable[x] = raw.comparable[x] + raw.comparable[x + 1] + raw.comparable[x + 2];
  }
}

/// Weighted sums of a tile's texels.
struct Sums {
  std::vector<float> weight;
  std::array<std::vector<float>, kColors> colors;
};

/// How far the patches around texels of one row and those `shift` from them agree, 0 to 1; called row by row.
class Agreement {
 public:
  Agreement(const Tile& tile, std::ptrdiff_t shift, std::size_t width) : tile_(tile), shift_(shift), width_(width) {
    const Differences empty{std::vector<float>(width + 2 * kPatch), std::vector<float>(width + 2 * kPatch)};
    raw_ = empty;
    ring_ = {empty, empty, empty};
    for (const std::ptrdiff_t row : {-1, 0}) differencesOfRow(tile_, row, shift_, width_, raw_, ringRow(row));
  }

  /// Rows from 0 on, without a gap.
  void ofRow(std::ptrdiff_t row, std::vector<float>& weights) {
    differencesOfRow(tile_, row + 1, shift_, width_, raw_, ringRow(row + 1));
    const std::uint32_t* chart = tile_.charts.data() + tile_.at(row, 0);
    const Differences& above = ringRow(row - 1);
    const Differences& here = ringRow(row);
    const Differences& below = ringRow(row + 1);
    for (std::size_t x = 0; x < width_; ++x) {
      const float distance = above.distance[x] + here.distance[x] + below.distance[x];
      const float comparable = above.comparable[x] + here.comparable[x] + below.comparable[x];
      // In this order of arguments what is not a number stays so, and is not greater than zero.
      const float agreement = 1.0f - std::max(distance / std::max(comparable, 1.0f), 0.0f) / kLargestDistance;
      const bool shares = chart[x] != 0 && chart[x] == chart[static_cast<std::ptrdiff_t>(x) + shift_];
      weights[x] = shares && agreement > 0.0f ? agreement * agreement : 0.0f;
    }
  }

 private:
  Differences& ringRow(std::ptrdiff_t row) { return ring_[static_cast<std::size_t>(row + 3) % 3]; }

  const Tile& tile_;
  std::ptrdiff_t shift_;
  std::size_t width_;
  Differences raw_;
  std::array<Differences, 3> ring_;
};

/// Adds to every texel of the tile the two that lie (dx, dy) and (-dx, -dy) from it, as far as the patches of both
/// agree with its own. Alone, a texel on one side would bend a slope of light, at the borders of charts most of all; in
/// pairs slopes cancel.
LUMEL_FOR_EACH_CPU void addPair(const Tile& tile, std::ptrdiff_t dx, std::ptrdiff_t dy, std::size_t width, Sums& sums) {
  const std::ptrdiff_t shift = dy * static_cast<std::ptrdiff_t>(tile.stride) + dx;
  Agreement ahead(tile, shift, width);
  Agreement behind(tile, -shift, width);
  std::vector<float> weights(width);
  std::vector<float> others(width);
  for (std::ptrdiff_t row = 0; row < static_cast<std::ptrdiff_t>(tile.rows); ++row) {
    ahead.ofRow(row, weights);
    behind.ofRow(row, others);
    const auto here = static_cast<std::ptrdiff_t>(tile.at(row, 0));
    const std::size_t to = static_cast<std::size_t>(row) * width;
    for (std::size_t x = 0; x < width; ++x) {
      weights[x] = std::min(weights[x], others[x]);
      sums.weight[to + x] += 2.0f * weights[x];
    }
    for (std::size_t c = 0; c < kColors; ++c) {
      const float* from = tile.colors[c].data() + here;
      float* sum = sums.colors[c].data() + to;
      for (std::size_t k = 0; k < width; ++k) {
        const auto x = static_cast<std::ptrdiff_t>(k);
        sum[k] += weights[k] > 0.0f ? weights[k] * (from[x + shift] + from[x - shift]) : 0.0f;
      }
    }
  }
}

Sums averageTile(const Tile& tile) {
  Sums sums;
  const std::size_t width = tile.columns;
  const std::size_t count = width * tile.rows;
  sums.weight.assign(count, 0.0f);
  for (std::size_t c = 0; c < kColors; ++c) sums.colors[c].assign(count, 0.0f);
  for (std::size_t row = 0; row < tile.rows; ++row) {
    const std::size_t here = tile.at(static_cast<std::ptrdiff_t>(row), 0);
    for (std::size_t x = 0; x < width; ++x) {
      if (tile.charts[here + x] == 0) continue;
      sums.weight[row * width + x] = 1.0f;
      for (std::size_t c = 0; c < kColors; ++c) sums.colors[c][row * width + x] = tile.colors[c][here + x];
    }
  }
  for (int dy = 0; dy <= kDenoiseRadius; ++dy)
    for (int dx = dy == 0 ? 1 : -kDenoiseRadius; dx <= kDenoiseRadius; ++dx) addPair(tile, dx, dy, width, sums);
  return sums;
}

/// Writes a tile's averages into a strip of the page; (row, column): of the tile in the strip.
void storeTile(const Tile& tile, std::size_t row, std::size_t column, std::size_t width,
               std::array<std::vector<float>, kMaps>& strip) {
  const Sums sums = averageTile(tile);
  for (std::size_t y = 0; y < tile.rows; ++y)
    for (std::size_t x = 0; x < tile.columns; ++x) {
      const std::size_t i = y * tile.columns + x;
      if (!(sums.weight[i] > 0.0f)) continue;
      float* pixel = nullptr;
      for (std::size_t c = 0; c < kColors; ++c) {
        if (c % 3 == 0) pixel = strip[c / 3].data() + ((row + y) * width + column + x) * 3;
        pixel[c % 3] = sums.colors[c][i] / sums.weight[i];
      }
    }
}

float luminanceAt(const Image& map, std::size_t texel) {
  const float* pixel = map.pixels.data() + 3 * texel;
  return luminance(Vec3(pixel[0], pixel[1], pixel[2]));
}

/// Per chart id, the light of its texels.
std::vector<double> lightOfCharts(const Image& flat, std::span<const std::uint32_t> chartIds) {
  std::vector<double> light(std::size_t{1} + *std::max_element(chartIds.begin(), chartIds.end()), 0.0);
  for (std::size_t i = 0; i < chartIds.size(); ++i) light[chartIds[i]] += static_cast<double>(luminanceAt(flat, i));
  return light;
}

/// Gives every chart back the light that averaging took where it curves, in proportion to what its texels hold: shared
/// by their noise, a texel that is dark but for one map would gain many times what that map holds.
void restoreLight(const std::array<Image*, kMaps>& maps, std::span<const std::uint32_t> chartIds,
                  const std::vector<double>& before) {
  std::vector<double> gain = lightOfCharts(*maps[0], chartIds);
  for (std::size_t c = 0; c < gain.size(); ++c) {
    gain[c] = before[c] / gain[c];
    // Texels of no chart stay as they are, and so do black charts and those with what is not a number.
    if (c == 0 || !std::isfinite(gain[c])) gain[c] = 1.0;
  }
  parallelFor(chartIds.size(), kTileRows * kTileColumns, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      for (Image* map : maps)
        for (std::size_t c = 0; c < 3; ++c) map->pixels[3 * i + c] *= static_cast<float>(gain[chartIds[i]]);
  });
}

}  // namespace

void denoise(Image& flat, std::array<Image, 3>& rnm, std::span<const std::uint32_t> chartIds,
             std::span<const float> standardError, std::size_t stride) {
  const auto width = static_cast<std::size_t>(flat.width);
  const auto height = static_cast<std::size_t>(flat.height);
  LUMEL_CHECK(chartIds.size() == width * height && standardError.size() + stride > width * height * stride);
  Rows before{{&flat, &rnm[0], &rnm[1], &rnm[2]}, {}};
  for (const Image* map : before.maps)
    LUMEL_CHECK(map->width == flat.width && map->height == flat.height && map->channels == 3);
  if (chartIds.empty()) return;
  const Judged judged{chartIds, standardError, stride};
  const std::vector<double> light = lightOfCharts(flat, chartIds);
  const std::size_t tilesPerRow = (width + kTileColumns - 1) / kTileColumns;
  std::array<std::vector<float>, kMaps> strip;
  for (std::size_t first = 0; first < height; first += kStripRows) {
    const std::size_t last = std::min(height, first + kStripRows);
    for (std::size_t m = 0; m < kMaps; ++m) {
      const auto from = before.maps[m]->pixels.begin() + static_cast<std::ptrdiff_t>(first * width * 3);
      strip[m].assign(from, from + static_cast<std::ptrdiff_t>((last - first) * width * 3));
    }
    const std::size_t tiles = tilesPerRow * ((last - first + kTileRows - 1) / kTileRows);
    parallelFor(tiles, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const std::size_t row = first + t / tilesPerRow * kTileRows;
        const std::size_t column = t % tilesPerRow * kTileColumns;
        const Tile tile = readTile(before, judged, static_cast<std::ptrdiff_t>(row), std::min(kTileRows, last - row),
                                   static_cast<std::ptrdiff_t>(column), std::min(kTileColumns, width - column));
        storeTile(tile, row - first, column, width, strip);
      }
    });
    if (last < height) before.keepBefore(static_cast<std::ptrdiff_t>(last));
    for (std::size_t m = 0; m < kMaps; ++m)
      std::copy(strip[m].begin(), strip[m].end(),
                before.maps[m]->pixels.begin() + static_cast<std::ptrdiff_t>(first * width * 3));
  }
  restoreLight(before.maps, chartIds, light);
}

}  // namespace lumel
