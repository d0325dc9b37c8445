#include "baker/gather/warm_sweeps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "baker/gather/gather_pass.h"
#include "baker/rays/flush_denormals.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// A wave has settled where the limits of its texels are known to this share of their light, in the mean.
constexpr float kSettled = 1e-3f;
/// A series that falls more slowly than this has no end that could be told from none.
constexpr float kSlowest = 0.9998f;
/// The first two terms may agree by chance.
constexpr int kFewestSweeps = 3;
constexpr int kMostSweeps = 64;
/// After so many sweeps a wave in a thousand no longer holds up the others: light that is caught in cracks.
constexpr int kPatientSweeps = 32;
constexpr double kCaught = 1e-3;
/// Where limits move by more than this, they are no better than the sum so far.
constexpr float kUnknown = 0.1f;
constexpr std::size_t kTexelGrain = 4096;
constexpr std::size_t kWaveGrain = kTexelGrain / kLanes;

float sumOf(const Vec3& light) { return light.x + light.y + light.z; }

}  // namespace

WarmSweeps::WarmSweeps(const GatherScene& scene, GatherState& state, const WarmLinks& links, std::vector<Vec3> first,
                       std::vector<Vec3> relit)
    : scene_(scene),
      state_(state),
      links_(links),
      substitutes_(substitutesFor(scene, state)),
      light_(std::move(first)),
      added_(std::move(relit)),
      ratio_(light_.size()),
      reflected_(light_.size()),
      drift_(scene.waves.size()) {}

/// Finds what texels reflect of `light`.
void WarmSweeps::reflect(std::span<const Vec3> light) {
  parallelFor(light.size(), kTexelGrain, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t t = first; t < last; ++t) reflected_[t] = unpackColor(state_.reflectance[t]) * light[t];
  });
  for (const TexelMap::Substitute& s : substitutes_)
    reflected_[s.texel] = unpackColor(state_.reflectance[s.texel]) * light[s.source];
}

void WarmSweeps::sweep(bool isFirst) {
  parallelFor(drift_.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t w = first; w < last; ++w) drift_[w] = sweepWave(w, isFirst);
  });
}

/// Adds what the texels of a wave find. Returns how far their limits have moved, relative to their light: the mean.
float WarmSweeps::sweepWave(std::size_t wave, bool isFirst) {
  const std::size_t start = scene_.waves[wave].start, end = start + scene_.waves[wave].count;
  WarmLinks::Reader link(links_, wave, start * kWarmRays);
  float drift = 0.0f;
  for (std::size_t t = start; t < end; ++t) {
    Vec3 found(0.0f);
    for (int ray = 0; ray < kWarmRays; ++ray, link.next())
      if (link.isTexel()) found += link.lightOf(reflected_);
    found /= static_cast<float>(kWarmRays);
    const Vec3 before = isFirst ? light_[t] : added_[t];
    added_[t] = isFirst ? added_[t] + found : found;
    light_[t] += added_[t];
    const float moved = driftOf(t, before, added_[t]);
    if (!state_.buried[t]) drift += moved;  // what buried texels find is not used
  }
  return drift / static_cast<float>(end - start);
}

/// How far the limit of a texel's series has moved with its last term, and will by all that follow if they move it in
/// proportion to what they add, relative to its light.
float WarmSweeps::driftOf(std::size_t texel, const Vec3& before, const Vec3& now) {
  const float last = sumOf(before), added = sumOf(now);
  const float ratioBefore = std::exchange(ratio_[texel], last > 0.0f ? std::min(added / last, kSlowest) : kSlowest);
  const float ratio = ratio_[texel];
  const float limit = sumOf(light_[texel]) + added * ratio / (1.0f - ratio);
  if (!(limit > 0.0f)) return 0.0f;
  const float moved = added / (1.0f - ratio) - last * ratioBefore / (1.0f - ratioBefore);
  const float drift = std::abs(moved) / ((1.0f - ratio) * limit);
  return drift < 1.0f ? drift : 1.0f;
}

bool WarmSweeps::hasSettled(int sweeps) const {
  if (sweeps < kFewestSweeps) return false;
  const auto moving = std::ranges::count_if(drift_, [](float drift) { return drift > kSettled; });
  return moving == 0 ||
         (sweeps >= kPatientSweeps && static_cast<double>(moving) <= kCaught * static_cast<double>(drift_.size()));
}

/// Adds the rest of each texel's series, where it is known to have an end.
void WarmSweeps::addRest() {
  parallelFor(drift_.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      if (drift_[w] > kUnknown) continue;
      const std::size_t start = scene_.waves[w].start, end = start + scene_.waves[w].count;
      for (std::size_t t = start; t < end; ++t)
        if (ratio_[t] < kSlowest) light_[t] += added_[t] * (ratio_[t] / (1.0f - ratio_[t]));
    }
  });
}

/// Makes what texels reflect of their light so far a level of the cache.
void WarmSweeps::keep(std::size_t level) {
  const auto store = [&](std::size_t texel, std::size_t source) {
    state_.radiance[texel * scene_.stored() + level] =
        packColor(unpackColor(state_.reflectance[texel]) * light_[source]);
  };
  parallelFor(light_.size(), kTexelGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) store(t, t);
  });
  for (const TexelMap::Substitute& s : substitutes_) store(s.texel, s.source);
}

void WarmSweeps::run() {
  const CacheLevels& levels = scene_.levels;
  if (!levels.endless && levels.base == 0) keep(0);
  const int sweeps = levels.endless ? kMostSweeps : levels.base + levels.count - 1;
  for (int number = 1; number <= sweeps; ++number) {
    reflect(number == 1 ? light_ : added_);
    sweep(number == 1);
    if (levels.endless && hasSettled(number)) break;
    if (!levels.endless && number >= levels.base) keep(static_cast<std::size_t>(number - levels.base));
  }
  if (!levels.endless) return;
  addRest();
  added_ = std::vector<Vec3>();  // `= {}` would keep the memory
  reflected_ = std::vector<Vec3>();
  ratio_ = std::vector<float>();
  state_.radiance.resize(light_.size());
  keep(0);
}

}  // namespace lumel
