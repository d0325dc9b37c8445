#include "baker/distribution.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

constexpr double kSteps = 16777216.0;  // 2^24
constexpr std::size_t kMostReserved = std::size_t{1} << 22;

double usable(float weight) { return std::isfinite(weight) && weight > 0.0f ? static_cast<double>(weight) : 0.0; }

}  // namespace

Distribution::Distribution(std::span<const float> weights) {
  std::size_t positive = 0;
  for (const float w : weights) {
    total_ += usable(w);
    if (usable(w) > 0) ++positive;
  }
  if (positive == 0) return;
  const double reserved = positive < kMostReserved ? static_cast<double>(positive) : 0.0;
  cumulative_.reserve(weights.size() + 1);
  cumulative_.push_back(0.0f);
  double sum = 0.0;
  double seen = 0.0;
  for (const float w : weights) {
    const double weight = usable(w);
    sum += weight;
    if (weight > 0 && reserved > 0) seen += 1.0;
    const double steps = seen + std::floor((kSteps - reserved) * std::min(1.0, sum / total_) + 0.5);
    cumulative_.push_back(static_cast<float>(std::min(steps, kSteps) / kSteps));
  }
  // The last positive weight ends at exactly one, and those after it have no share.
  for (std::size_t i = cumulative_.size(); i-- > 1;) {
    cumulative_[i] = 1.0f;
    if (usable(weights[i - 1]) > 0) break;
  }
}

std::size_t Distribution::choose(float u) const {
  const auto above = std::upper_bound(cumulative_.begin() + 1, cumulative_.end() - 1, u);
  return static_cast<std::size_t>(above - cumulative_.begin()) - 1;
}

float Distribution::rest(float u, std::size_t index) const {
  const float share = (u - cumulative_[index]) / probability(index);
  return std::clamp(share, 0.0f, 0x1.fffffep-1f);
}

}  // namespace lumel
