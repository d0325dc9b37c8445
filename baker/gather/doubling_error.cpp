#include "baker/gather/doubling_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Rates that are believed. Below 1 means fall more slowly than those of independent samples: what is seen of a cache
/// that itself still moves, and outliers that come late.
constexpr double kSlowest = 0.85;
constexpr double kFastest = 2.0;
/// A place is darker than those around it where the square of its light is less than this share of theirs: within a
/// room places differ by less.
constexpr double kDarkerPlace = 0.25;

}  // namespace

DoublingError::DoublingError(const Waves& waves, double creditTaken)
    : ofWaves(waves.size()), squares(waves.texels()), sums(waves.texels()), credit(creditTaken) {}

void DoublingError::add(const Waves& waves, std::size_t index, std::span<const float> before,
                        std::span<const float> now, std::uint32_t n0, std::uint32_t n1, std::uint32_t leftOut) {
  const Wave& wave = waves[index];
  OfWave& known = ofWaves[index];
  // now - before is d for equal halves; independent samples would have the same expectation with others by this.
  const double scale = std::sqrt(static_cast<double>(n0) / n1);
  double sum = 0.0;
  double sumBefore = 0.0;
  known.counting = 0;
  for (std::size_t i = 0; i < wave.count; ++i) {
    float& square = squares[wave.start + i];
    if ((leftOut >> i) & 1u) {
      square = sums[wave.start + i] = kLeftOut;
      continue;
    }
    ++known.counting;
    sumBefore += static_cast<double>(square);
    const double d = (static_cast<double>(now[i]) - static_cast<double>(before[i])) * scale;
    square = static_cast<float>(d * d);
    sum += d * d;
  }
  known.movedBefore = n0 == n1 && known.moved >= 0.0 ? sumBefore : -1.0;
  known.moved = n0 == 0 ? -1.0 : sum;
  known.samplesBefore = n0;
  known.samples = n0 + n1;
}

void DoublingError::addMaps(const Waves& waves, std::size_t index, const MapMeans& before, const MapMeans& now,
                            std::uint32_t n0, std::uint32_t n1, std::uint32_t leftOut) {
  const Wave& wave = waves[index];
  const std::size_t maps = mapSums.size() / squares.size();
  const double scale = std::sqrt(static_cast<double>(n0) / n1);
  // The rate is that of the passes before: the one of this pass is known when all waves are through.
  const double fall = n0 == 0 ? 0.0 : std::pow(static_cast<double>(n0) / (n0 + n1), rate);
  for (std::size_t i = 0; i < wave.count; ++i)
    for (std::size_t k = 0; k < maps; ++k) {
      float& sum = mapSums[(wave.start + i) * maps + k];
      const double d = (static_cast<double>(now[k][i]) - static_cast<double>(before[k][i])) * scale;
      sum = (leftOut >> i) & 1u ? kLeftOut : static_cast<float>(static_cast<double>(sum) * fall + d * d);
    }
}

void DoublingError::endPass(const Waves& waves, const std::vector<std::uint8_t>& live, std::span<const float> places) {
  double before = 0.0;
  double now = 0.0;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    OfWave& known = ofWaves[w];
    if (!live[w]) continue;
    if (!places.empty()) {
      known.place = 0.0;
      for (const float place : places.subspan(waves[w].start, waves[w].count))
        known.place += static_cast<double>(place) * static_cast<double>(place) / waves[w].count;
    }
    if (!(known.movedBefore >= 0.0 && known.place > 0.0)) continue;
    // Texels that move by a quarter of their place's light and more have it from a few rays, and outweigh all others.
    if (!places.empty() && std::max(known.movedBefore, known.moved) > known.place) continue;
    before += known.movedBefore / known.place;
    now += known.moved / known.place;
  }
  if (before > 0.0 && now > 0.0) rate = std::clamp(std::log2(before / now), kSlowest, kFastest);
  const double factor = std::pow(std::exp2(rate) - 1.0, -credit);
  for (std::size_t w = 0; w < waves.size(); ++w) {
    OfWave& known = ofWaves[w];
    if (!live[w] || known.samplesBefore == 0) continue;
    const auto fall = static_cast<float>(std::pow(static_cast<double>(known.samplesBefore) / known.samples, rate));
    double sum = 0.0;
    for (std::size_t t = waves[w].start; t < waves[w].start + waves[w].count; ++t) {
      if (sums[t] == kLeftOut) continue;
      sums[t] = sums[t] * fall + squares[t];
      sum += static_cast<double>(sums[t]);
    }
    ++known.doublings;
    known.factor = factor;
    known.meanSquare = sum / (std::max(1u, known.counting) * static_cast<double>(known.doublings));
  }
  parallelFor(waves.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w)
      if (live[w] && ofWaves[w].doublings > 0) pool(waves, w);
  });
}

void DoublingError::pool(const Waves& waves, std::size_t index) {
  OfWave& known = ofWaves[index];
  double pooled = 0.0, place = 0.0;
  double texels = 0.0;
  for (const std::uint32_t w : waves.around(index)) {
    if (w == Waves::kNone || ofWaves[w].doublings == 0) continue;
    const OfWave& near = ofWaves[w];
    // A wave that was done earlier has fewer samples.
    const double fall =
        near.samples == known.samples ? 1.0 : std::pow(static_cast<double>(near.samples) / known.samples, rate);
    pooled += near.meanSquare * near.counting * fall;
    place += near.place * near.counting;
    texels += near.counting;
  }
  known.pool = texels > 0.0 ? pooled / texels : 0.0;
  known.poolPlace = texels > 0.0 ? place / texels : 0.0;
}

double DoublingError::OfWave::shareOfPool(double light) const {
  return light * light < kDarkerPlace * poolPlace ? light * light / (kDarkerPlace * poolPlace) : 1.0;
}

/// `own`: of the texel's d^2, `pool`: mean d^2 of the neighbourhood.
double DoublingError::error(const OfWave& known, double factor, double own, double pool) {
  if (known.doublings == 0) return std::numeric_limits<double>::quiet_NaN();
  const double joined = (own + kPrior * pool) / (known.doublings + kPrior);
  const double moved = own < 0.0 ? pool : std::max(own / known.doublings, joined);
  return std::sqrt(factor * moved);
}

float DoublingError::standardError(const Waves& waves, std::size_t index, std::size_t i,
                                   std::span<const float> places) const {
  const OfWave& known = ofWaves[index];
  const std::size_t t = waves[index].start + i;
  const double pool = places.empty() ? known.pool : known.pool * known.shareOfPool(static_cast<double>(places[t]));
  return static_cast<float>(error(known, known.factor, static_cast<double>(sums[t]), pool));
}

std::vector<float> DoublingError::takeMapErrors(const Waves& waves, std::size_t maps, std::span<const float> places) {
  // Per wave, the sums of its texels that count, in the units of one d^2.
  std::vector<std::array<double, kMostMaps>> ofWave(waves.size());
  parallelFor(waves.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      if (ofWaves[w].doublings == 0) continue;
      for (std::size_t t = waves[w].start; t < waves[w].start + waves[w].count; ++t)
        for (std::size_t k = 0; k < maps; ++k)
          ofWave[w][k] += std::max(0.0, static_cast<double>(mapSums[t * maps + k])) / ofWaves[w].doublings;
    }
  });
  std::vector<float> errors = std::move(mapSums);
  parallelFor(waves.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      std::array<double, kMostMaps> pool{};
      double texels = 0.0;
      for (const std::uint32_t near : waves.around(w)) {
        if (near == Waves::kNone || ofWaves[near].doublings == 0) continue;
        const std::uint32_t samples = ofWaves[w].samples;
        // A wave that was done earlier has fewer samples.
        const double fall = ofWaves[near].samples == samples
                                ? 1.0
                                : std::pow(static_cast<double>(ofWaves[near].samples) / samples, rate);
        for (std::size_t k = 0; k < maps; ++k) pool[k] += ofWave[near][k] * fall;
        texels += ofWaves[near].counting;
      }
      const double factor = std::pow(ofWaves[w].factor, kMapCredit);
      for (std::size_t t = waves[w].start; t < waves[w].start + waves[w].count; ++t) {
        const double share = places.empty() ? 1.0 : ofWaves[w].shareOfPool(static_cast<double>(places[t]));
        for (std::size_t k = 0; k < maps; ++k) {
          float& value = errors[t * maps + k];
          value = static_cast<float>(
              error(ofWaves[w], factor, static_cast<double>(value), texels > 0.0 ? share * pool[k] / texels : 0.0));
        }
      }
    }
  });
  return errors;
}

}  // namespace lumel
