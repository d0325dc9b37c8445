#include "baker/doubling_error.h"

#include <algorithm>
#include <cmath>

#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel {

DoublingError::DoublingError(std::span<const std::uint32_t> runLengths, std::span<const std::uint32_t> groups,
                             double credit)
    : credit_(credit) {
  LUMEL_CHECK(runLengths.size() == groups.size());
  std::size_t texels = 0;
  runs_.reserve(runLengths.size());
  for (std::size_t r = 0; r < runLengths.size(); ++r) {
    runs_.push_back({.first = texels, .count = runLengths[r], .group = groups[r]});
    texels += runLengths[r];
  }
  squares_.resize(texels);
  sums_.resize(texels);
}

void DoublingError::add(std::size_t index, std::span<const float> before, std::span<const float> now, std::uint32_t n0,
                        std::uint32_t n1) {
  Run& run = runs_[index];
  // now - before is d for equal halves; independent samples would have the same expectation with others by this.
  const double scale = std::sqrt(static_cast<double>(n0) / n1);
  double sum = 0.0;
  for (std::size_t i = 0; i < run.count; ++i) {
    const double d = (static_cast<double>(now[i]) - static_cast<double>(before[i])) * scale;
    squares_[run.first + i] = static_cast<float>(d * d);
    sum += d * d;
  }
  run.movedBefore = n0 == n1 ? run.moved : -1.0;
  run.moved = n0 == 0 ? -1.0 : sum;
  run.samplesBefore = n0;
  run.samples = n0 + n1;
}

void DoublingError::endPass(const std::vector<std::uint8_t>& live) {
  double before = 0.0;
  double now = 0.0;
  for (std::size_t r = 0; r < runs_.size(); ++r)
    if (live[r] && runs_[r].movedBefore >= 0.0) {
      before += runs_[r].movedBefore;
      now += runs_[r].moved;
    }
  if (before > 0.0 && now > 0.0) rate_ = std::clamp(std::log2(before / now), 1.0, 2.0);
  const double factor = std::pow(std::exp2(rate_) - 1.0, -credit_);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    Run& run = runs_[r];
    if (!live[r] || run.samplesBefore == 0) continue;
    const auto fall = static_cast<float>(std::pow(static_cast<double>(run.samplesBefore) / run.samples, rate_));
    double sum = 0.0;
    for (std::size_t t = run.first; t < run.first + run.count; ++t) {
      sums_[t] = sums_[t] * fall + squares_[t];
      sum += static_cast<double>(sums_[t]);
    }
    ++run.doublings;
    run.factor = factor;
    run.meanSquare = sum / (static_cast<double>(run.count) * run.doublings);
  }
  parallelFor(runs_.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r)
      if (live[r] && runs_[r].doublings > 0) runs_[r].pool = poolAround(r);
  });
}

double DoublingError::poolAround(std::size_t index) const {
  const Run& run = runs_[index];
  const std::size_t least = index - std::min(index, kReach);
  const std::size_t most = std::min(runs_.size() - 1, index + kReach);
  double pooled = 0.0;
  double texels = 0.0;
  for (std::size_t r = least; r <= most; ++r) {
    const Run& near = runs_[r];
    if (near.group != run.group || near.doublings == 0) continue;
    // A run that was done earlier has fewer samples.
    const double fall =
        near.samples == run.samples ? 1.0 : std::pow(static_cast<double>(near.samples) / run.samples, rate_);
    pooled += near.meanSquare * near.count * fall;
    texels += near.count;
  }
  return pooled / texels;
}

float DoublingError::standardError(std::size_t index, std::size_t i) const {
  const Run& run = runs_[index];
  if (run.doublings == 0) return 0.0f;
  const double moved = (static_cast<double>(sums_[run.first + i]) + kPrior * run.pool) / (run.doublings + kPrior);
  return static_cast<float>(std::sqrt(run.factor * moved));
}

}  // namespace lumel
