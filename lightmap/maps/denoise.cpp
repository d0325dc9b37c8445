#include "lightmap/maps/denoise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "lightmap/maps/encoding.h"
#include "scene/base/check.h"
#include "scene/base/each_cpu.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr int kPatch = 1;        // patches of 3 x 3 texels are compared
constexpr int kNoiseWindow = 2;  // noise is measured over 5 x 5 texels
constexpr int kRadius = 4;       // texels up to so many away, across and along, are averaged
/// Texels of a tile's margin: what the comparisons of its texels, and the noise of what they look at, are found by.
constexpr int kHalo = kRadius + kPatch + kNoiseWindow + 1;
/// Tiles that stay in a core's cache while all pairs are added, in strips that bound what is kept of changed rows.
constexpr std::size_t kTileRows = 32;
constexpr std::size_t kTileColumns = 256;
constexpr std::size_t kStripRows = 4 * kTileRows;

/// Variance of the luminance of an encoding's map over that of the flat map where there is nothing to measure it by,
/// and what is believed of measurements: tilted maps see less evenly than the flat one.
constexpr float kMapVariance = 2.0f;
constexpr float kLeastMapVariance = 1.5f;
constexpr float kMostMapVariance = 8.0f;
/// Stated variances may be too large, by so much at few samples.
constexpr float kLeastOfStated = 0.5f;
/// Patches further apart than so many times their noise (as variance, beyond what noise explains) share nothing.
constexpr float kLargestDistance = 6.0f;
/// What a texel counts without its opposite, at a distance of one texel; it falls with the square of the distance, as
/// does the square of the bend that it makes on a slope.
constexpr float kUnpaired = 0.5f;
/// What averaging bends of light, squared, by how far the averaged texels differ beyond their noise. Calibrated
/// (README): most of it is slopes, of which symmetric weights bend nothing.
constexpr float kBiasShare = 0.05f;
/// Noise below this share of a texel's light is rounding. It is not more than that light either: stated errors are
/// shared with the texels around, and dark ones beside bright ones would take from these.
constexpr float kLeastRelativeError = 1e-5f;
/// More maps would hardly tell more of where texels differ.
constexpr std::size_t kMostJudges = 6;

/// Part of a page, with a margin around it, one plane per quantity so that loops along rows vectorise.
struct Tile {
  std::size_t rows = 0;
  std::size_t columns = 0;
  std::size_t stride = 0;
  std::vector<std::uint32_t> charts;
  std::vector<float> variance;                // of the flat map's luminance
  std::vector<std::vector<float>> flatByMap;  // that over the variance of each of the encoding's maps
  std::array<std::vector<float>, 3> normals;
  std::vector<float> stated;  // variance of the flat map's luminance as it was handed over; 0: not known
  // Of all maps, the flat one first.
  std::vector<std::vector<float>> luminances;
  std::vector<std::vector<float>> colors;
  std::size_t judges = 0;  // so many of the encoding's maps tell how far texels are apart

  std::size_t maps() const { return luminances.size(); }
  std::size_t at(std::ptrdiff_t row, std::ptrdiff_t x) const {
    return static_cast<std::size_t>((row + kHalo) * static_cast<std::ptrdiff_t>(stride) + x + kHalo);
  }
};

/// The rows of the maps and of the flat one's errors as they were: those above `firstKept` + kHalo have changed, of the
/// last of them `kept` and `keptErrors` hold copies.
struct Rows {
  std::span<Image* const> maps;
  ErrorPlane errors;
  std::vector<std::vector<float>> kept = {};  // kHalo rows
  std::vector<float> keptErrors = {};
  std::ptrdiff_t firstKept = -kHalo;

  std::size_t rowSize() const { return static_cast<std::size_t>(maps[0]->width) * 3; }
  const float* row(std::size_t map, std::ptrdiff_t y) const {
    if (y >= firstKept + kHalo) return maps[map]->pixels.data() + static_cast<std::size_t>(y) * rowSize();
    return kept[map].data() + static_cast<std::size_t>(y - firstKept) * rowSize();
  }
  ErrorPlane errorRow(std::ptrdiff_t y) {
    const auto width = static_cast<std::size_t>(maps[0]->width);
    if (y >= firstKept + kHalo) return {&errors[static_cast<std::size_t>(y) * width], errors.stride};
    return {keptErrors.data() + static_cast<std::size_t>(y - firstKept) * width, 1};
  }
  /// Before rows up to `last`, all of them after those that are kept, change. They must be at least kHalo.
  void keepBefore(std::ptrdiff_t last) {
    firstKept = last - kHalo;
    kept.resize(maps.size());
    for (std::size_t m = 0; m < maps.size(); ++m) {
      const float* from = maps[m]->pixels.data() + static_cast<std::size_t>(firstKept) * rowSize();
      kept[m].assign(from, from + kHalo * rowSize());
    }
    const auto width = static_cast<std::size_t>(maps[0]->width);
    keptErrors.resize(kHalo * width);
    for (std::size_t i = 0; i < keptErrors.size(); ++i)
      keptErrors[i] = errors[static_cast<std::size_t>(firstKept) * width + i];
  }
};

/// What the texels of a page are judged by.
struct Judged {
  std::span<const std::uint32_t> chartIds;
  std::span<const CoarseNormal> normals;
  std::size_t judges = 0;
};

Tile readTile(Rows& from, const Judged& judged, std::ptrdiff_t firstRow, std::size_t rows, std::ptrdiff_t firstColumn,
              std::size_t columns) {
  const std::ptrdiff_t width = from.maps[0]->width;
  const std::ptrdiff_t height = from.maps[0]->height;
  Tile tile;
  tile.rows = rows;
  tile.judges = judged.judges;
  tile.columns = columns;
  tile.stride = columns + 2 * kHalo;
  const std::size_t count = tile.stride * (rows + 2 * kHalo);
  tile.charts.assign(count, 0);
  tile.variance.assign(count, std::numeric_limits<float>::min());
  const std::size_t maps = from.maps.size();
  tile.flatByMap.assign(maps - 1, std::vector<float>(count, 1.0f / kMapVariance));
  for (auto& plane : tile.normals) plane.assign(count, 0.0f);
  tile.stated.assign(count, 0.0f);
  tile.luminances.assign(maps, std::vector<float>(count, 0.0f));
  tile.colors.assign(3 * maps, std::vector<float>(count, 0.0f));
  const std::ptrdiff_t left = std::max<std::ptrdiff_t>(0, firstColumn - kHalo);
  const std::ptrdiff_t right = std::min(width, firstColumn + static_cast<std::ptrdiff_t>(columns) + kHalo);
  for (std::ptrdiff_t row = -kHalo; row < static_cast<std::ptrdiff_t>(rows) + kHalo; ++row) {
    const std::ptrdiff_t y = firstRow + row;
    if (y < 0 || y >= height) continue;
    std::array<const float*, 1 + kMostMaps> pixels{};
    for (std::size_t m = 0; m < maps; ++m) pixels[m] = from.row(m, y);
    const ErrorPlane errors = from.errorRow(y);
    for (std::ptrdiff_t x = left; x < right; ++x) {
      const auto source = static_cast<std::size_t>(y * width + x);
      if (judged.chartIds[source] == 0) continue;
      const std::size_t to = tile.at(row, x - firstColumn);
      tile.charts[to] = judged.chartIds[source];
      for (std::size_t c = 0; c < 3; ++c)
        tile.normals[c][to] = static_cast<float>(judged.normals[source][c]) / kCoarseNormal;
      for (std::size_t m = 0; m < maps; ++m) {
        const float* pixel = pixels[m] + x * 3;
        for (std::size_t c = 0; c < 3; ++c) tile.colors[m * 3 + c][to] = pixel[c];
        tile.luminances[m][to] = luminance(Vec3(pixel[0], pixel[1], pixel[2]));
      }
      const float stated = errors[static_cast<std::size_t>(x)];
      if (std::isfinite(stated)) tile.stated[to] = stated * stated;
      const float light = tile.luminances[0][to];
      const float error = std::max(std::min(std::isfinite(stated) ? stated : 0.0f, light), kLeastRelativeError * light);
      tile.variance[to] += error * error;
    }
  }
  return tile;
}

/// Replaces every entry by the sum over the entries that lie up to kNoiseWindow times `step` before and after it.
void sumWindows(std::vector<float>& plane, std::size_t step, std::vector<float>& scratch) {
  scratch.assign(plane.size(), 0.0f);
  const std::size_t margin = kNoiseWindow * step;
  for (std::size_t i = margin; i + margin < plane.size(); ++i)
    scratch[i] = plane[i - 2 * step] + plane[i - step] + plane[i] + plane[i + step] + plane[i + 2 * step];
  plane.swap(scratch);
}

/// Sets the variances by how far texels lie off the middle between the two beside them, in x and in y: independent
/// noise of variance V makes that 1.5 V in the mean of squares. Where light itself curves it adds to that, so the flat
/// map's stated variance is the most; to the other maps it adds in proportion, and their ratios to the flat one hold.
LUMEL_FOR_EACH_CPU void measureNoise(Tile& tile) {
  const std::size_t count = tile.charts.size();
  std::vector<std::vector<float>> squares(tile.maps(), std::vector<float>(count, 0.0f));
  std::vector<float> terms(count, 0.0f);
  std::vector<float> scratch;
  const std::uint32_t* chart = tile.charts.data();
  for (const std::size_t step : {std::size_t{1}, tile.stride})
    for (std::size_t m = 0; m < tile.maps(); ++m) {
      const float* light = tile.luminances[m].data();
      float* sum = squares[m].data();
      for (std::size_t i = step; i + step < count; ++i) {
        const float d = 0.5f * (light[i - step] + light[i + step]) - light[i];
        const bool inside = chart[i] != 0 && chart[i] == chart[i - step] && chart[i] == chart[i + step];
        sum[i] += inside && d * d <= std::numeric_limits<float>::max() ? d * d : 0.0f;
        if (m == 0) terms[i] += inside ? 1.5f : 0.0f;
      }
    }
  const auto sumAround = [&](std::vector<float>& plane) {
    sumWindows(plane, 1, scratch);
    sumWindows(plane, tile.stride, scratch);
  };
  for (auto& plane : squares) sumAround(plane);
  sumAround(terms);
  for (std::size_t i = 0; i < count; ++i) {
    const bool measured = squares[0][i] > 0.0f;
    const float flat = squares[0][i];
    const float stated = tile.variance[i];
    tile.variance[i] = measured ? std::max(kLeastOfStated * stated, std::min(flat / terms[i], stated)) : stated;
    for (std::size_t m = 0; m + 1 < tile.maps(); ++m) {
      const float ratio = std::max(flat / squares[m + 1][i], 1.0f / kMostMapVariance);
      tile.flatByMap[m][i] = measured ? std::min(ratio, 1.0f / kLeastMapVariance) : 1.0f / kMapVariance;
    }
  }
}

/// Scratch of one row of differences: 1 and the distance where both texels are of one chart, else 0 and 0.
struct Differences {
  std::vector<float> distance;
  std::vector<float> comparable;
};

/// Squared differences of `count` texels from `first` on and those `shift` from them, less what their noise explains,
/// relative to that noise; the mean over the flat map and `Maps` others.
template <std::size_t Maps>
[[gnu::always_inline]] inline void distancesOf(const Tile& tile, std::size_t first, std::ptrdiff_t shift,
                                               std::size_t count, float* distance) {
  const float* variance = tile.variance.data() + first;
  const float* flat = tile.luminances[0].data() + first;
  std::array<const float*, Maps> light{}, trust{};
  for (std::size_t m = 0; m < Maps; ++m) {
    light[m] = tile.luminances[m + 1].data() + first;
    trust[m] = tile.flatByMap[m].data() + first;
  }
#pragma GCC ivdep
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::ptrdiff_t>(k);
    const float noise = variance[i] + variance[i + shift];
    const float ofFlat = flat[i] - flat[i + shift];
    float others = 0.0f;
    for (std::size_t m = 0; m < Maps; ++m) {
      const float difference = light[m][i] - light[m][i + shift];
      others += difference * difference * (trust[m][i] + trust[m][i + shift]);
    }
    const float squares = ofFlat * ofFlat + 0.5f * others;
    distance[k] = squares / (static_cast<float>(1 + Maps) * noise) - 1.0f;
  }
}

/// The same for as many maps as judge: with their number known the loop over texels becomes vector code.
[[gnu::always_inline]] inline void distancesOf(const Tile& tile, std::size_t first, std::ptrdiff_t shift,
                                               std::size_t count, float* distance) {
  switch (tile.judges) {
    case 1:
      return distancesOf<1>(tile, first, shift, count, distance);
    case 2:
      return distancesOf<2>(tile, first, shift, count, distance);
    case 3:
      return distancesOf<3>(tile, first, shift, count, distance);
    case 4:
      return distancesOf<4>(tile, first, shift, count, distance);
    case 5:
      return distancesOf<5>(tile, first, shift, count, distance);
    case 6:
      return distancesOf<6>(tile, first, shift, count, distance);
    default:
      LUMEL_CHECK(false);
  }
}

/// Distances of a row's texels, summed along it. Each entry is the sum over a row of the patch. `first`: the tile's
/// entry of the first of `width`.
void differencesOfRow(const Tile& tile, std::size_t first, std::ptrdiff_t shift, std::size_t width, Differences& raw,
                      Differences& out) {
  first -= kPatch;
  const std::size_t count = width + 2 * kPatch;
  const std::uint32_t* chart = tile.charts.data() + first;
  float* distance = raw.distance.data();
  float* comparable = raw.comparable.data();
  distancesOf(tile, first, shift, count, distance);
  // A loop of its own: as a choice in the one above, compilers would branch around the division.
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::ptrdiff_t>(k);
    const bool same = (chart[i] != 0) & (chart[i] == chart[i + shift]);
    distance[k] = same ? distance[k] : 0.0f;
    comparable[k] = same ? 1.0f : 0.0f;
  }
  for (std::size_t x = 0; x < width; ++x) {
    out.distance[x] = raw.distance[x] + raw.distance[x + 1] + raw.distance[x + 2];
    out.comparable[x] = raw.comparable[x] + raw.comparable[x + 1] + raw.comparable[x + 2];
  }
}

/// How far the patches around texels of a tile and those (dx, dy) from them agree, 0 to 1. It starts before the tile,
/// where the texels opposite of those of the tile are: -dy rows and, if dx > 0, -dx columns from its first.
struct Agreements {
  std::size_t stride;
  std::vector<float> weights;

  Agreements(const Tile& tile, int dx, int dy);
};

Agreements::Agreements(const Tile& tile, int dx, int dy)
    : stride(tile.columns + static_cast<std::size_t>(std::abs(dx))),
      weights(stride * (tile.rows + static_cast<std::size_t>(dy))) {
  const std::ptrdiff_t shift = dy * static_cast<std::ptrdiff_t>(tile.stride) + dx;
  const std::size_t first = tile.at(-dy, std::min(0, -dx));
  const std::size_t rows = tile.rows + static_cast<std::size_t>(dy);
  const Differences empty{std::vector<float>(stride + 2 * kPatch), std::vector<float>(stride + 2 * kPatch)};
  Differences raw = empty;
  std::array<Differences, 3> ring = {empty, empty, empty};
  differencesOfRow(tile, first - tile.stride, shift, stride, raw, ring[0]);
  differencesOfRow(tile, first, shift, stride, raw, ring[1]);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t here = first + row * tile.stride;
    const Differences& above = ring[row % 3];
    const Differences& at = ring[(row + 1) % 3];
    Differences& below = ring[(row + 2) % 3];
    differencesOfRow(tile, here + tile.stride, shift, stride, raw, below);
    const std::uint32_t* chart = tile.charts.data() + here;
    const float* nx = tile.normals[0].data() + here;
    const float* ny = tile.normals[1].data() + here;
    const float* nz = tile.normals[2].data() + here;
    float* to = weights.data() + row * stride;
    for (std::size_t k = 0; k < stride; ++k) {
      const auto x = static_cast<std::ptrdiff_t>(k);
      const float distance = above.distance[k] + at.distance[k] + below.distance[k];
      const float comparable = above.comparable[k] + at.comparable[k] + below.comparable[k];
      // In this order of arguments what is not a number stays so, and is not greater than zero.
      const float agreement = 1.0f - std::max(distance / std::max(comparable, 1.0f), 0.0f) / kLargestDistance;
      const float cosine = nx[x] * nx[x + shift] + ny[x] * ny[x + shift] + nz[x] * nz[x + shift];
      const float facing = std::min(3.0f * cosine - 2.0f, 1.0f);  // 0 at 48 degrees
      const float both = (agreement > 0.0f ? agreement : 0.0f) * (facing > 0.0f ? facing : 0.0f);
      to[k] = both * both;
    }
    for (std::size_t k = 0; k < stride; ++k) {
      const auto x = static_cast<std::ptrdiff_t>(k);
      const bool shares = (chart[x] != 0) & (chart[x] == chart[x + shift]);
      to[k] = shares ? to[k] : 0.0f;
    }
  }
}

/// Weighted sums of a tile's texels.
struct Sums {
  std::vector<float> weight;
  std::vector<std::vector<float>> colors;
  std::vector<float> variance;             // squared weights times stated variances
  std::vector<std::vector<float>> spread;  // per map: weights times squared differences from the texel's own luminance
};

/// Adds to every texel of the tile the two that lie (dx, dy) and (-dx, -dy) from it, dy >= 0, as far as the patches of
/// both agree with its own. Alone, a texel on one side bends a slope of light, at the borders of charts most of all; in
/// pairs slopes cancel.
LUMEL_FOR_EACH_CPU void addPair(const Tile& tile, int dx, int dy, Sums& sums) {
  const Agreements agreements(tile, dx, dy);
  const std::ptrdiff_t shift = dy * static_cast<std::ptrdiff_t>(tile.stride) + dx;
  const std::size_t width = tile.columns;
  const float unpaired = kUnpaired / static_cast<float>(dx * dx + dy * dy);
  std::vector<float> aheads(width);
  std::vector<float> behinds(width);
  for (std::size_t row = 0; row < tile.rows; ++row) {
    const float* ahead =
        agreements.weights.data() + (row + static_cast<std::size_t>(dy)) * agreements.stride + std::max(dx, 0);
    const float* behind = agreements.weights.data() + row * agreements.stride + std::max(-dx, 0);
    const std::size_t to = row * width;
    for (std::size_t x = 0; x < width; ++x) {
      const float both = std::min(ahead[x], behind[x]);
      aheads[x] = both + unpaired * (ahead[x] - both);
      behinds[x] = both + unpaired * (behind[x] - both);
      sums.weight[to + x] += aheads[x] + behinds[x];
    }
    const auto here = static_cast<std::ptrdiff_t>(tile.at(static_cast<std::ptrdiff_t>(row), 0));
    for (std::size_t c = 0; c < tile.colors.size(); ++c) {
      const float* from = tile.colors[c].data() + here;
      float* sum = sums.colors[c].data() + to;
      for (std::size_t k = 0; k < width; ++k) {
        const auto x = static_cast<std::ptrdiff_t>(k);
        const float next = aheads[k] > 0.0f ? aheads[k] * from[x + shift] : 0.0f;
        const float last = behinds[k] > 0.0f ? behinds[k] * from[x - shift] : 0.0f;
        sum[k] += next + last;
      }
    }
    const float* stated = tile.stated.data() + here;
    float* variance = sums.variance.data() + to;
    for (std::size_t k = 0; k < width; ++k) {
      const auto x = static_cast<std::ptrdiff_t>(k);
      variance[k] += aheads[k] * aheads[k] * stated[x + shift] + behinds[k] * behinds[k] * stated[x - shift];
    }
    for (std::size_t m = 0; m < tile.maps(); ++m) {
      const float* light = tile.luminances[m].data() + here;
      float* spread = sums.spread[m].data() + to;
      for (std::size_t k = 0; k < width; ++k) {
        const auto x = static_cast<std::ptrdiff_t>(k);
        const float next = light[x + shift] - light[x], last = light[x - shift] - light[x];
        spread[k] += (aheads[k] > 0.0f ? aheads[k] * (next * next) : 0.0f) +
                     (behinds[k] > 0.0f ? behinds[k] * (last * last) : 0.0f);
      }
    }
  }
}

Sums averageTile(const Tile& tile) {
  Sums sums;
  const std::size_t width = tile.columns;
  const std::size_t count = width * tile.rows;
  sums.weight.assign(count, 0.0f);
  sums.colors.assign(tile.colors.size(), std::vector<float>(count, 0.0f));
  sums.variance.assign(count, 0.0f);
  sums.spread.assign(tile.maps(), std::vector<float>(count, 0.0f));
  for (std::size_t row = 0; row < tile.rows; ++row) {
    const std::size_t here = tile.at(static_cast<std::ptrdiff_t>(row), 0);
    for (std::size_t x = 0; x < width; ++x) {
      if (tile.charts[here + x] == 0) continue;
      sums.weight[row * width + x] = 1.0f;
      for (std::size_t c = 0; c < tile.colors.size(); ++c) sums.colors[c][row * width + x] = tile.colors[c][here + x];
      sums.variance[row * width + x] = tile.stated[here + x];
    }
  }
  for (int dy = 0; dy <= kRadius; ++dy)
    for (int dx = dy == 0 ? 1 : -kRadius; dx <= kRadius; ++dx) addPair(tile, dx, dy, sums);
  return sums;
}

/// A strip of the page, which averages are stored to.
struct Averages {
  std::size_t width;
  std::size_t firstRow;  // of the strip
  std::vector<std::vector<float>> strip;
  std::vector<std::vector<float>> errors;
};

/// Errors of averages: what the weights leave of the noise, and a share of how far the averaged texels differ beyond it
/// (README, "Errors of what is delivered"). `own`: the texel's entry in the tile with its margin, `i` that in the sums,
/// `pixel` that in the strip.
void storeErrors(const Tile& tile, const Sums& sums, std::size_t own, std::size_t i, std::size_t pixel, Averages& to) {
  const float weight = sums.weight[i];
  const float left = sums.variance[i] / (weight * weight);
  // The texels differ by their noise in the other maps as they do in the flat one.
  // Averaging adds none, whatever noisier texels beside one that states next to nothing say.
  const float share = tile.stated[own] > left ? left / tile.stated[own] : 1.0f;
  for (std::size_t m = 0; m < tile.maps(); ++m) {
    float& error = to.errors[m][pixel];
    if (!std::isfinite(error)) continue;
    const float* color = to.strip[m].data() + 3 * pixel;
    const float moved = luminance(Vec3(color[0], color[1], color[2])) - tile.luminances[m][own];
    const float spread = sums.spread[m][i] / weight - moved * moved;
    const float variance = error * error;
    error = std::sqrt(variance * share + kBiasShare * std::max(spread - variance * (1.0f - share), 0.0f));
  }
}

/// (row, column): of the tile on the page.
void storeTile(const Tile& tile, const Sums& sums, std::size_t row, std::size_t column, Averages& to) {
  for (std::size_t y = 0; y < tile.rows; ++y)
    for (std::size_t x = 0; x < tile.columns; ++x) {
      const std::size_t i = y * tile.columns + x;
      if (!(sums.weight[i] > 0.0f)) continue;
      const std::size_t texel = (row + y) * to.width + column + x;
      const std::size_t pixel = 3 * (texel - to.firstRow * to.width);
      for (std::size_t c = 0; c < sums.colors.size(); ++c)
        to.strip[c / 3][pixel + c % 3] = sums.colors[c][i] / sums.weight[i];
      storeErrors(tile, sums, tile.at(static_cast<std::ptrdiff_t>(y), static_cast<std::ptrdiff_t>(x)), i,
                  texel - to.firstRow * to.width, to);
    }
}

/// Averages the texels of a page.
void averagePage(std::span<Image* const> maps, std::span<const ErrorPlane> errors, const Judged& judged) {
  const auto width = static_cast<std::size_t>(maps[0]->width);
  const auto height = static_cast<std::size_t>(maps[0]->height);
  const std::size_t tilesPerRow = (width + kTileColumns - 1) / kTileColumns;
  Rows before{maps, errors[0]};
  Averages to{width, 0, std::vector<std::vector<float>>(maps.size()), std::vector<std::vector<float>>(maps.size())};
  for (std::size_t first = 0; first < height; first += kStripRows) {
    const std::size_t last = std::min(height, first + kStripRows);
    to.firstRow = first;
    for (std::size_t m = 0; m < maps.size(); ++m) {
      const auto from = maps[m]->pixels.begin() + static_cast<std::ptrdiff_t>(first * width * 3);
      to.strip[m].assign(from, from + static_cast<std::ptrdiff_t>((last - first) * width * 3));
      to.errors[m].resize((last - first) * width);
      for (std::size_t i = 0; i < to.errors[m].size(); ++i) to.errors[m][i] = errors[m][first * width + i];
    }
    const std::size_t tiles = tilesPerRow * ((last - first + kTileRows - 1) / kTileRows);
    parallelFor(tiles, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const std::size_t row = first + t / tilesPerRow * kTileRows;
        const std::size_t column = t % tilesPerRow * kTileColumns;
        Tile tile = readTile(before, judged, static_cast<std::ptrdiff_t>(row), std::min(kTileRows, last - row),
                             static_cast<std::ptrdiff_t>(column), std::min(kTileColumns, width - column));
        measureNoise(tile);
        storeTile(tile, averageTile(tile), row, column, to);
      }
    });
    if (last < height) before.keepBefore(static_cast<std::ptrdiff_t>(last));
    for (std::size_t m = 0; m < maps.size(); ++m) {
      std::copy(to.strip[m].begin(), to.strip[m].end(),
                maps[m]->pixels.begin() + static_cast<std::ptrdiff_t>(first * width * 3));
      for (std::size_t i = 0; i < to.errors[m].size(); ++i) errors[m][first * width + i] = to.errors[m][i];
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
void restoreLight(std::span<Image* const> maps, std::span<const std::uint32_t> chartIds,
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

void denoise(Image& flat, std::span<Image> encoded, std::span<const std::uint32_t> chartIds,
             std::span<const CoarseNormal> normals, std::span<const ErrorPlane> errors, std::size_t judges) {
  const std::size_t count = static_cast<std::size_t>(flat.width) * static_cast<std::size_t>(flat.height);
  LUMEL_CHECK(chartIds.size() == count && errors.size() == 1 + encoded.size());
  LUMEL_CHECK(!encoded.empty() && encoded.size() <= kMostMaps);
  std::vector<Image*> maps{&flat};
  for (Image& map : encoded) maps.push_back(&map);
  for (const Image* map : maps)
    LUMEL_CHECK(map->width == flat.width && map->height == flat.height && map->channels == 3);
  if (chartIds.empty()) return;
  const std::vector<double> light = lightOfCharts(flat, chartIds);
  averagePage(maps, errors, {chartIds, normals, std::min({judges, encoded.size(), kMostJudges})});
  restoreLight(maps, chartIds, light);
}

}  // namespace lumel
