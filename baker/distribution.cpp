#include "baker/distribution.h"

#include <algorithm>
#include <cmath>

#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

constexpr double kSteps = 16777216.0;  // 2^24
constexpr std::size_t kMostReserved = std::size_t{1} << 22;
/// A guide's borders are taken for lower by this share: the product that finds the place in it is rounded.
constexpr double kGuideSlack = 0x1p-22;

double usable(float weight) { return std::isfinite(weight) && weight > 0.0f ? static_cast<double>(weight) : 0.0; }

[[gnu::always_inline]] inline float restOf(float u, float lower, float upper) {
  return within((u - lower) / (upper - lower), 0.0f, 0x1.fffffep-1f);
}

}  // namespace

Distribution::Distribution(std::span<const float> weights, std::size_t rows) {
  LUMEL_CHECK(rows > 0 && weights.size() % rows == 0);
  size_ = weights.size() / rows;
  cumulative_.assign(rows * (size_ + kAhead), 1.0f);
  guide_.assign(weights.size(), 0);
  totals_.assign(rows, 0.0);
  parallelFor(rows, 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row) fill(weights.subspan(row * size_, size_), row);
  });
}

void Distribution::fill(std::span<const float> weights, std::size_t row) {
  double& total = totals_[row];
  std::size_t positive = 0;
  for (const float w : weights) {
    total += usable(w);
    if (usable(w) > 0) ++positive;
  }
  const std::span<float> cumulative = std::span(cumulative_).subspan(row * (size_ + kAhead), size_ + 1);
  cumulative[0] = 0.0f;
  if (positive == 0) return;
  const double reserved = positive < kMostReserved ? static_cast<double>(positive) : 0.0;
  double sum = 0.0;
  double seen = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    const double weight = usable(weights[i]);
    sum += weight;
    if (weight > 0 && reserved > 0) seen += 1.0;
    const double steps = seen + std::floor((kSteps - reserved) * std::min(1.0, sum / total) + 0.5);
    cumulative[i + 1] = static_cast<float>(std::min(steps, kSteps) / kSteps);
  }
  // The last positive weight ends at exactly one, and those after it have no share.
  for (std::size_t i = size_; i > 0; --i) {
    cumulative[i] = 1.0f;
    if (usable(weights[i - 1]) > 0) break;
  }
  std::int32_t index = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    const double border = static_cast<double>(i) / static_cast<double>(size_) * (1.0 - kGuideSlack);
    while (static_cast<double>(cumulative[static_cast<std::size_t>(index) + 1]) <= border) ++index;
    guide_[row * size_ + i] = index;
  }
}

inline std::size_t Distribution::guideTo(float u, std::size_t row) const {
  const auto place = static_cast<std::size_t>(static_cast<std::int32_t>(u * static_cast<float>(size_)));
  return static_cast<std::size_t>(guide_[row * size_ + std::min(place, size_ - 1)]);
}

/// From an index that is not too late to the one whose interval holds u. Without a branch for a step: how many there
/// are cannot be foretold.
inline std::size_t Distribution::advance(const float* cumulative, std::size_t index, float u) {
  for (;;) {
    std::size_t steps = 0;
    for (std::size_t i = 1; i <= kAhead; ++i) steps += cumulative[index + i] <= u ? 1 : 0;
    index += steps;
    if (steps < kAhead) return index;
  }
}

std::size_t Distribution::choose(float u, std::size_t row) const {
  return advance(cumulativeOf(row), guideTo(u, row), u);
}

void Distribution::choose(const float* u, const LaneFlags& rows, Lanes& chosen) const {
  // Each step for all lanes before the next one, so that they wait for memory together.
  std::array<std::size_t, kLanes> index;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto row = static_cast<std::size_t>(rows[lane]);
    index[lane] = guideTo(u[lane], row);
    __builtin_prefetch(cumulativeOf(row) + index[lane] + 1);
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float* cumulative = cumulativeOf(static_cast<std::size_t>(rows[lane]));
    const std::size_t at = advance(cumulative, index[lane], u[lane]);
    chosen.index[lane] = static_cast<int>(at);
    chosen.rest[lane] = restOf(u[lane], cumulative[at], cumulative[at + 1]);
  }
}

float Distribution::rest(float u, std::size_t index, std::size_t row) const {
  const float* cumulative = cumulativeOf(row);
  return restOf(u, cumulative[index], cumulative[index + 1]);
}

}  // namespace lumel
