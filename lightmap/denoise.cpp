#include "lightmap/denoise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

constexpr std::size_t kMaps = 4;
constexpr std::size_t kColors = 3 * kMaps;
constexpr int kPatch = 1;  // patches of 3 x 3 texels are compared
constexpr int kHalo = kDenoiseRadius + kPatch;
constexpr std::size_t kBandRows = 32;

/// Variance of the luminance of an RNM map over that of the flat map: 1.7 to 2 measured over a level and a box.
constexpr float kRnmVariance = 2.0f;
/// Patches further apart than so many times their noise (as variance, beyond what noise explains) share nothing.
constexpr float kLargestDistance = 4.0f;
/// Noise below this share of a texel's light is rounding.
constexpr float kLeastRelativeError = 1e-5f;

/// Some rows of a page, with a margin around them, one plane per quantity so that loops along rows vectorise.
struct Band {
  std::size_t rows = 0;
  std::size_t stride = 0;
  std::vector<std::uint32_t> charts;
  std::vector<float> variance;
  std::array<std::vector<float>, kMaps> luminances;
  std::array<std::vector<float>, kColors> colors;

  std::size_t at(std::ptrdiff_t row, std::ptrdiff_t x) const {
    return static_cast<std::size_t>((row + kHalo) * static_cast<std::ptrdiff_t>(stride) + x + kHalo);
  }
};

using MapPointers = std::array<const Image*, kMaps>;

Band readBand(const MapPointers& maps, std::span<const std::uint32_t> chartIds, std::span<const float> standardError,
              std::ptrdiff_t firstRow, std::size_t rows) {
  const std::ptrdiff_t width = maps[0]->width;
  const std::ptrdiff_t height = maps[0]->height;
  Band band;
  band.rows = rows;
  band.stride = static_cast<std::size_t>(width + 2 * kHalo);
  const std::size_t count = band.stride * (rows + 2 * kHalo);
  band.charts.assign(count, 0);
  band.variance.assign(count, std::numeric_limits<float>::min());
  for (auto& plane : band.luminances) plane.assign(count, 0.0f);
  for (auto& plane : band.colors) plane.assign(count, 0.0f);
  for (std::ptrdiff_t row = -kHalo; row < static_cast<std::ptrdiff_t>(rows) + kHalo; ++row) {
    const std::ptrdiff_t y = firstRow + row;
    if (y < 0 || y >= height) continue;
    for (std::ptrdiff_t x = 0; x < width; ++x) {
      const auto source = static_cast<std::size_t>(y * width + x);
      if (chartIds[source] == 0) continue;
      const std::size_t to = band.at(row, x);
      band.charts[to] = chartIds[source];
      for (std::size_t m = 0; m < kMaps; ++m) {
        const Vec3 color = maps[m]->rgb(static_cast<int>(x), static_cast<int>(y));
        for (int c = 0; c < 3; ++c) band.colors[m * 3 + static_cast<std::size_t>(c)][to] = color[c];
        band.luminances[m][to] = luminance(color);
      }
      const float error = std::max(standardError[source], kLeastRelativeError * band.luminances[0][to]);
      band.variance[to] += error * error;
    }
  }
  return band;
}

/// Scratch of one row of differences: 1 and the distance where both texels are of one chart, else 0 and 0.
struct Differences {
  std::vector<float> distance;
  std::vector<float> comparable;
};

/// Squared difference of texels `shift` apart, less what their noise explains, relative to that noise; the mean over
/// the four maps. Each entry is the sum over a row of the patch. Entries x of [0, width).
void differencesOfRow(const Band& band, std::ptrdiff_t row, std::ptrdiff_t shift, std::size_t width, Differences& raw,
                      Differences& out) {
  const std::size_t first = band.at(row, -kPatch);
  const std::size_t count = width + 2 * kPatch;
  const std::uint32_t* chart = band.charts.data() + first;
  const float* variance = band.variance.data() + first;
  std::array<const float*, kMaps> light{};
  for (std::size_t m = 0; m < kMaps; ++m) light[m] = band.luminances[m].data() + first;
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

/// Weighted sums of a band's texels.
struct Sums {
  std::vector<float> weight;
  std::array<std::vector<float>, kColors> colors;
};

/// How far the patches around texels of one row and those `shift` from them agree, 0 to 1; called row by row.
class Agreement {
 public:
  Agreement(const Band& band, std::ptrdiff_t shift, std::size_t width) : band_(band), shift_(shift), width_(width) {
    const Differences empty{std::vector<float>(width + 2 * kPatch), std::vector<float>(width + 2 * kPatch)};
    raw_ = empty;
    ring_ = {empty, empty, empty};
    for (const std::ptrdiff_t row : {-1, 0}) differencesOfRow(band_, row, shift_, width_, raw_, ringRow(row));
  }

  /// Rows from 0 on, without a gap.
  void ofRow(std::ptrdiff_t row, std::vector<float>& weights) {
    differencesOfRow(band_, row + 1, shift_, width_, raw_, ringRow(row + 1));
    const std::uint32_t* chart = band_.charts.data() + band_.at(row, 0);
    for (std::size_t x = 0; x < width_; ++x) {
      const float distance = ring_[0].distance[x] + ring_[1].distance[x] + ring_[2].distance[x];
      const float comparable = ring_[0].comparable[x] + ring_[1].comparable[x] + ring_[2].comparable[x];
      // In this order of arguments what is not a number stays so, and is not greater than zero.
      const float agreement = 1.0f - std::max(distance / std::max(comparable, 1.0f), 0.0f) / kLargestDistance;
      const bool shares = chart[x] != 0 && chart[x] == chart[static_cast<std::ptrdiff_t>(x) + shift_];
      weights[x] = shares && agreement > 0.0f ? agreement * agreement : 0.0f;
    }
  }

 private:
  Differences& ringRow(std::ptrdiff_t row) { return ring_[static_cast<std::size_t>(row + 3) % 3]; }

  const Band& band_;
  std::ptrdiff_t shift_;
  std::size_t width_;
  Differences raw_;
  std::array<Differences, 3> ring_;
};

/// Adds to every texel of the band the two that lie (dx, dy) and (-dx, -dy) from it, as far as the patches of both
/// agree with its own. Alone, a texel on one side would bend a slope of light, at the borders of charts most of all; in
/// pairs slopes cancel.
void addPair(const Band& band, std::ptrdiff_t dx, std::ptrdiff_t dy, std::size_t width, Sums& sums) {
  const std::ptrdiff_t shift = dy * static_cast<std::ptrdiff_t>(band.stride) + dx;
  Agreement ahead(band, shift, width);
  Agreement behind(band, -shift, width);
  std::vector<float> weights(width);
  std::vector<float> others(width);
  for (std::ptrdiff_t row = 0; row < static_cast<std::ptrdiff_t>(band.rows); ++row) {
    ahead.ofRow(row, weights);
    behind.ofRow(row, others);
    const auto here = static_cast<std::ptrdiff_t>(band.at(row, 0));
    const std::size_t to = static_cast<std::size_t>(row) * width;
    for (std::size_t x = 0; x < width; ++x) {
      weights[x] = std::min(weights[x], others[x]);
      sums.weight[to + x] += 2.0f * weights[x];
    }
    for (std::size_t c = 0; c < kColors; ++c) {
      const float* from = band.colors[c].data() + here;
      float* sum = sums.colors[c].data() + to;
      for (std::size_t k = 0; k < width; ++k) {
        const auto x = static_cast<std::ptrdiff_t>(k);
        sum[k] += weights[k] > 0.0f ? weights[k] * (from[x + shift] + from[x - shift]) : 0.0f;
      }
    }
  }
}

Sums averageBand(const Band& band, std::size_t width) {
  Sums sums;
  const std::size_t count = width * band.rows;
  sums.weight.assign(count, 0.0f);
  for (std::size_t c = 0; c < kColors; ++c) sums.colors[c].assign(count, 0.0f);
  for (std::size_t row = 0; row < band.rows; ++row) {
    const std::size_t here = band.at(static_cast<std::ptrdiff_t>(row), 0);
    for (std::size_t x = 0; x < width; ++x) {
      if (band.charts[here + x] == 0) continue;
      sums.weight[row * width + x] = 1.0f;
      for (std::size_t c = 0; c < kColors; ++c) sums.colors[c][row * width + x] = band.colors[c][here + x];
    }
  }
  for (int dy = 0; dy <= kDenoiseRadius; ++dy)
    for (int dx = dy == 0 ? 1 : -kDenoiseRadius; dx <= kDenoiseRadius; ++dx) addPair(band, dx, dy, width, sums);
  return sums;
}

}  // namespace

void denoise(Image& flat, std::array<Image, 3>& rnm, std::span<const std::uint32_t> chartIds,
             std::span<const float> standardError) {
  const auto width = static_cast<std::size_t>(flat.width);
  const auto height = static_cast<std::size_t>(flat.height);
  LUMEL_CHECK(chartIds.size() == width * height && standardError.size() == width * height);
  const std::array<Image*, kMaps> maps = {&flat, &rnm[0], &rnm[1], &rnm[2]};
  for (const Image* map : maps)
    LUMEL_CHECK(map->width == flat.width && map->height == flat.height && map->channels == 3);
  // Bands read rows that their neighbours change.
  const std::array<Image, kMaps> before = {flat, rnm[0], rnm[1], rnm[2]};
  const MapPointers from = {&before[0], &before[1], &before[2], &before[3]};
  parallelFor(height, kBandRows, [&](std::size_t first, std::size_t last) {
    const Band band = readBand(from, chartIds, standardError, static_cast<std::ptrdiff_t>(first), last - first);
    const Sums sums = averageBand(band, width);
    for (std::size_t i = 0; i < sums.weight.size(); ++i) {
      const std::size_t texel = first * width + i;
      if (chartIds[texel] == 0 || !(sums.weight[i] > 0.0f)) continue;
      for (std::size_t c = 0; c < kColors; ++c)
        maps[c / 3]->pixels[texel * 3 + c % 3] = sums.colors[c][i] / sums.weight[i];
    }
  });
}

}  // namespace lumel
