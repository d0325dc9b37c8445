#include "baker/gather/waves/light_effort.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

/// Cost of a gather ray with all that follows, in light samples.
constexpr float kGatherCost = 4.0f;
/// Standard deviation, as a share of a texel's light, below which more light samples are not worth their time.
constexpr float kSmoothEnough = 0.15f;
/// The share of waves that see no difference and yet are crossed by an edge that they missed.
constexpr float kMissedEdges = 0.01f;
constexpr int kFewest = -3;  // powers of two
constexpr int kMost = 2;

float deviation(const LightSpread& spread) {
  const float missed = spread.unshadowed * kMissedEdges / (1.0f + spread.samples * kLanes);
  return std::sqrt(spread.variance + missed);
}

}  // namespace

void LightTally::enter(LightSpread& spread, std::uint32_t samples, std::size_t texels) const {
  if (samples == 0 || texels == 0) return;
  const auto n = static_cast<float>(samples);
  float variance = 0.0f;
  float mean = 0.0f;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    variance += std::max(0.0f, squares[lane] - sum[lane] * sum[lane] / n);
    mean += sum[lane];
  }
  const float perTexel = 1.0f / (n * static_cast<float>(texels));
  // A single sample tells nothing of its variance.
  const float weight = n / (n + spread.samples);
  if (samples > 1) {
    const float unbiased = variance / ((n - 1.0f) * static_cast<float>(texels));
    spread.variance += (unbiased - spread.variance) * weight;
  }
  spread.unshadowed += (unshadowed * perTexel - spread.unshadowed) * weight;
  spread.mean += (mean * perTexel - spread.mean) * weight;
  spread.samples += n;
}

std::uint32_t lightStretch(std::uint32_t sample) {
  return static_cast<std::uint32_t>(std::upper_bound(kLightStretches.begin(), kLightStretches.end(), sample) -
                                    kLightStretches.begin());
}

int lightPower(std::span<const LightSpread> all, std::size_t strategy) {
  if (!(all[strategy].samples > 0.0f)) return 0;
  float light = 0.0f;
  for (const LightSpread& spread : all) light += spread.mean;
  const float measure = std::max(deviation(all.back()), kSmoothEnough * light);
  const float share = std::sqrt(kGatherCost) * deviation(all[strategy]) / measure;
  if (!(share > 0.0f)) return kFewest;
  return static_cast<int>(std::lround(std::clamp(std::log2(share), float{kFewest}, float{kMost})));
}

PunctualChoice punctualChoice(const PunctualLights& lights, std::span<const LightStrategy> strategies,
                              std::span<const LightSpread> spreads) {
  PunctualChoice choice{LearntChoice(lights.groups())};
  for (std::size_t k = 0; k < std::min(strategies.size(), spreads.size()); ++k) {
    const LightStrategy& strategy = strategies[k];
    const LightSpread& seen = spreads[k];
    if (strategy.kind > LightStrategy::OnePunctual || !(seen.unshadowed > 0.0f)) continue;
    const bool isOne = strategy.kind == LightStrategy::OnePunctual;
    const std::size_t others = strategy.kind == LightStrategy::NearPunctual ? lights.directional() : 0;
    const std::size_t first = isOne ? strategy.light : others;
    const std::size_t end = std::min(isOne ? first + 1 : lights.size(), lights.groups());
    // The second moment of what arrives: the mean square of a texel's samples.
    const float arrived = std::min(seen.unshadowed, seen.variance + seen.mean * seen.mean);
    for (std::size_t group = first; group < end; ++group) choice.learnt.record(group, seen.unshadowed, arrived);
  }
  choice.learnt.learn();
  return choice;
}

}  // namespace lumel
