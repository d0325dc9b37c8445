#include "baker/light/distribution.h"

#include <algorithm>
#include <cmath>

#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr double kSteps = 16777216.0;  // 2^24
constexpr std::size_t kMostReserved = std::size_t{1} << 22;
constexpr std::uint16_t kRowSteps = 1 << 15;
/// A guide's borders are taken for lower by this share: the product that finds the place in it is rounded.
constexpr double kGuideSlack = 0x1p-22;

double usable(float weight) { return std::isfinite(weight) && weight > 0.0f ? static_cast<double>(weight) : 0.0; }

[[gnu::always_inline]] inline float restOf(float u, float lower, float upper) {
  return within((u - lower) / (upper - lower), 0.0f, 0x1.fffffep-1f);
}

}  // namespace

Distribution::Distribution(std::span<const float> weights) : size_(weights.size()) {
  cumulative_.assign(size_ + kAhead, 1.0f);
  guide_.assign(size_, 0);
  std::size_t positive = 0;
  for (const float w : weights) {
    total_ += usable(w);
    if (usable(w) > 0) ++positive;
  }
  cumulative_[0] = 0.0f;
  if (positive == 0) return;
  const double reserved = positive < kMostReserved ? static_cast<double>(positive) : 0.0;
  double sum = 0.0;
  double seen = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    const double weight = usable(weights[i]);
    sum += weight;
    if (weight > 0 && reserved > 0) seen += 1.0;
    const double steps = seen + std::floor((kSteps - reserved) * std::min(1.0, sum / total_) + 0.5);
    cumulative_[i + 1] = static_cast<float>(std::min(steps, kSteps) / kSteps);
  }
  // The last positive weight ends at exactly one, and those after it have no share.
  for (std::size_t i = size_; i > 0; --i) {
    cumulative_[i] = 1.0f;
    if (usable(weights[i - 1]) > 0) break;
  }
  std::int32_t index = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    const double border = static_cast<double>(i) / static_cast<double>(size_) * (1.0 - kGuideSlack);
    while (static_cast<double>(cumulative_[static_cast<std::size_t>(index) + 1]) <= border) ++index;
    guide_[i] = index;
  }
}

inline std::size_t Distribution::guideTo(float u) const {
  const auto place = static_cast<std::size_t>(static_cast<std::int32_t>(u * static_cast<float>(size_)));
  return static_cast<std::size_t>(guide_[std::min(place, size_ - 1)]);
}

/// Goes from an index that is not too late to the one whose interval holds u. It takes a branch only every kAhead
/// steps: how many there are cannot be foretold.
inline std::size_t Distribution::advance(std::size_t index, float u) const {
  for (;;) {
    std::size_t steps = 0;
    for (std::size_t i = 1; i <= kAhead; ++i) steps += cumulative_[index + i] <= u ? 1 : 0;
    index += steps;
    if (steps < kAhead) return index;
  }
}

void Distribution::choose(const float* u, Lanes& chosen) const {
  // Each step for all lanes before the next one, so that they wait for memory together.
  std::array<std::size_t, kLanes> index;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    index[lane] = guideTo(u[lane]);
    __builtin_prefetch(cumulative_.data() + index[lane] + 1);
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t at = advance(index[lane], u[lane]);
    chosen.index[lane] = static_cast<int>(at);
    chosen.rest[lane] = restOf(u[lane], cumulative_[at], cumulative_[at + 1]);
  }
}

DistributionRows::DistributionRows(std::span<const float> weights, std::size_t rows) {
  LUMEL_CHECK(rows > 0 && weights.size() % rows == 0 && weights.size() / rows <= kMostWeights);
  size_ = weights.size() / rows;
  partSize_ = ((size_ + kParts - 1) / kParts + kAhead - 1) / kAhead * kAhead;
  stride_ = kParts * partSize_ + kAhead;
  lowest_.assign(rows * stride_, kRowSteps);
  ofParts_.assign(rows * kParts, kRowSteps);
  totals_.assign(rows, 0.0);
  parallelFor(rows, 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row) fill(weights.subspan(row * size_, size_), row);
  });
}

void DistributionRows::fill(std::span<const float> weights, std::size_t row) {
  for (const float w : weights) totals_[row] += usable(w);
  std::uint16_t* lowest = lowest_.data() + row * stride_;
  // Those that would have less than two steps have one; the others share what is left and lose none by rounding.
  const auto isLeast = [&](double weight) { return weight * kRowSteps < 2.0 * totals_[row]; };
  double least = 0.0;
  double shared = 0.0;
  for (const float w : weights) {
    if (usable(w) > 0 && isLeast(usable(w))) least += 1.0;
    if (usable(w) > 0 && !isLeast(usable(w))) shared += usable(w);
  }
  double taken = 0.0;
  double sum = 0.0;
  std::size_t end = 0;  // after the last positive one
  for (std::size_t i = 0; i < size_; ++i) {
    lowest[i] = static_cast<std::uint16_t>(taken + std::floor((kRowSteps - least) * (shared > 0 ? sum / shared : 0.0)));
    const double weight = usable(weights[i]);
    if (!(weight > 0)) continue;
    end = i + 1;
    (isLeast(weight) ? taken : sum) += isLeast(weight) ? 1.0 : weight;
  }
  std::fill(lowest + end, lowest + size_, static_cast<std::uint16_t>(kRowSteps));
  for (std::size_t part = 0; part < kParts; ++part) ofParts_[row * kParts + part] = lowest[part * partSize_];
}

/// Counts the entries, of Count, that are not above `step`.
template <std::size_t Count>
[[gnu::always_inline]] inline std::size_t countUpTo(const std::uint16_t* entries, std::uint16_t step) {
  int count = 0;
  for (std::size_t i = 0; i < Count; ++i) count += entries[i] <= step ? 1 : 0;
  return static_cast<std::size_t>(count);
}

LUMEL_FOR_EACH_CPU void DistributionRows::find(const DistributionRows& all, const float* u, const LaneFlags& rows,
                                               Distribution::Lanes& chosen) {
  const std::size_t partSize = all.partSize_, stride = all.stride_;
  std::array<std::size_t, kLanes> begins;
  std::array<std::uint16_t, kLanes> steps;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto row = static_cast<std::size_t>(rows[lane]);
    steps[lane] = static_cast<std::uint16_t>(static_cast<int>(u[lane] * static_cast<float>(kRowSteps)));
    // Where indices begin at the same step only the last has a share.
    const std::size_t part = countUpTo<kParts>(all.ofParts_.data() + row * kParts, steps[lane]) - 1;
    begins[lane] = part * partSize;
    for (std::size_t i = 0; i <= partSize; i += 32)
      __builtin_prefetch(all.lowest_.data() + row * stride + begins[lane] + i);
  }
  alignas(64) float lower[kLanes], upper[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::uint16_t* lowest = all.lowest_.data() + static_cast<std::size_t>(rows[lane]) * stride;
    std::size_t index = begins[lane] - 1;
    for (std::size_t i = 0; i < partSize; i += kAhead)
      index += countUpTo<kAhead>(lowest + begins[lane] + i, steps[lane]);
    chosen.index[lane] = static_cast<int>(index);
    lower[lane] = static_cast<float>(lowest[index]) * (1.0f / kRowSteps);
    upper[lane] = static_cast<float>(lowest[index + 1]) * (1.0f / kRowSteps);
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) chosen.rest[lane] = restOf(u[lane], lower[lane], upper[lane]);
}

void DistributionRows::choose(const float* u, const LaneFlags& rows, Distribution::Lanes& chosen) const {
  find(*this, u, rows, chosen);
}

}  // namespace lumel
