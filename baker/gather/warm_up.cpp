#include "baker/gather/warm_up.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "baker/gather/each_wave.h"
#include "baker/gather/gather_pass.h"
#include "baker/gather/warm_links.h"
#include "baker/gather/waves/warm_wave.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Endless light: a wave has settled where another bounce adds less than this share of its own light, or changes what
/// all of them come to by less. No more than kMostBeyond of its light is from bounces that were not followed, since
/// rooms that are lit through others get theirs late; and none where each bounce has more than kSlowest of the light of
/// the one before. The warm-up ends where all waves but this share have settled (in cracks light moves for long), or
/// after so many sweeps. Places that do not see each other are judged each by its own light: beside a field in the sun
/// a lamp's room is nothing to the sum of all.
constexpr double kSettled = 1e-4;
constexpr double kMostBeyond = 0.002;
constexpr double kSlowest = 0.98;
constexpr double kStillMoving = 1e-3;
constexpr int kMostSweeps = 256;
constexpr std::size_t kTexelGrain = 4096;
constexpr std::size_t kWaveGrain = kTexelGrain / kLanes;

/// The light that is passed along links.
class Sweeping {
 public:
  /// `first`: irradiance / pi to begin with; `constant`: what every sweep finds again, links apart.
  Sweeping(const GatherScene& scene, GatherState& state, const WarmLinks& links, std::vector<Vec3> first,
           std::span<const Vec3> constant)
      : scene_(scene),
        state_(state),
        links_(links),
        substitutes_(substitutesFor(scene, state)),
        light_(std::move(first)),
        constant_(constant),
        reflected_(light_.size()),
        series_(scene.waves.size()) {}

  /// Sweeps until the light has settled, or as many times as the cache has levels, and fills the cache.
  void run();

 private:
  /// The light of a wave's texels, sum by sum: in the end every sweep adds the same share of what the one before it
  /// did, and the rest is a geometric series.
  struct Series {
    double total = 0.0;
    double added = 0.0;   // by the last sweep
    double limit = 0.0;   // of the series as the last sweep lets it be seen
    float beyond = 0.0f;  // times more of what the last sweep added: the rest, where it is known
    bool settled = false;
    void add(double next);
  };

  void reflect(bool addRest);
  void sweep();
  bool haveSettled() const;
  void keep(int level);

  const GatherScene& scene_;
  GatherState& state_;
  const WarmLinks& links_;
  const std::vector<TexelMap::Substitute> substitutes_;
  std::vector<Vec3> light_;
  const std::span<const Vec3> constant_;
  // What links look up: one product instead of two values from all over the memory.
  std::vector<PackedColor> reflected_;
  std::vector<Series> series_;  // of the waves
};

void Sweeping::Series::add(double next) {
  const double addedNow = next - total;
  const double ratio = added > 0.0 ? std::clamp(addedNow / added, 0.0, kSlowest) : kSlowest;
  const double rest = addedNow * ratio / (1.0 - ratio);
  const bool known = rest <= kMostBeyond * next && std::abs(next + rest - limit) <= kSettled * next;
  settled = known || addedNow <= kSettled * next;
  beyond = known ? static_cast<float>(ratio / (1.0 - ratio)) : 0.0f;
  total = next;
  added = addedNow;
  limit = next + rest;
}

/// Finds what texels reflect of their light; with `addRest` also of what sweeps to come would add.
void Sweeping::reflect(bool addRest) {
  for (const TexelMap::Substitute& s : substitutes_) light_[s.texel] = light_[s.source];
  parallelFor(series_.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      const float beyond = addRest ? series_[w].beyond : 0.0f;
      const std::size_t start = scene_.waves[w].start;
      for (std::size_t t = start; t < start + scene_.waves[w].count; ++t) {
        Vec3 now = unpackColor(state_.reflectance[t]) * light_[t];
        if (beyond > 0.0f) now += beyond * glm::max(now - unpackColor(reflected_[t]), Vec3(0.0f));
        reflected_[t] = packColor(now);
      }
    }
  });
}

/// Passes on what texels reflect.
void Sweeping::sweep() {
  const Waves& waves = scene_.waves;
  parallelFor(waves.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      const std::size_t start = waves[w].start;
      WarmLinks::Reader link(links_, w, start * kWarmRays);
      double sum = 0.0;
      for (std::size_t t = start; t < start + waves[w].count; ++t) {
        Vec3 found(0.0f);
        for (int ray = 0; ray < kWarmRays; ++ray, link.next())
          if (link.isTexel()) found += link.lightOf(reflected_);
        light_[t] = constant_[t] + found / static_cast<float>(kWarmRays);
        sum += static_cast<double>(luminance(light_[t]));
      }
      series_[w].add(sum);
    }
  });
}

bool Sweeping::haveSettled() const {
  const auto moving = std::ranges::count_if(series_, [](const Series& series) { return !series.settled; });
  return static_cast<double>(moving) <= kStillMoving * static_cast<double>(series_.size());
}

void Sweeping::keep(int level) {
  for (std::size_t t = 0; t < reflected_.size(); ++t)
    state_.radiance[t * scene_.stored() + static_cast<std::size_t>(level)] = reflected_[t];
}

void Sweeping::run() {
  const CacheLevels& levels = scene_.levels;
  reflect(false);
  if (!levels.endless && levels.base == 0) keep(0);
  const int sweeps = levels.endless ? kMostSweeps : levels.base + levels.count - 1;
  for (int number = 1; number <= sweeps; ++number) {
    sweep();
    const bool settled = levels.endless && haveSettled();
    reflect(settled);
    if (settled) break;
    if (!levels.endless && number >= levels.base) keep(number - levels.base);
  }
  if (levels.endless) state_.radiance = std::move(reflected_);
}

}  // namespace

Expected<std::vector<DividedTexel>> findDivided(const GatherScene& scene, Progress& progress) {
  std::vector<std::vector<DividedTexel>> ofWaves(scene.waves.size());
  parallelFor(ofWaves.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last && !progress.cancelled(); ++w) {
      const Wave& wave = scene.waves[w];
      const TexelParts parts(scene.transport.rays, scene.transport.materials, scene.atlas, scene.texels[wave.page]);
      std::array<std::uint32_t, kLanes> texels;
      std::iota(texels.begin(), texels.end(), wave.first);
      forEachLane(parts.suspects(std::span(texels).first(wave.count)), [&](std::size_t lane) {
        const TexelCoord at = scene.texels[wave.page].coords[texels[lane]];
        const std::uint32_t seed = TexelSampler(scene.seed, wave.page, at.x, at.y).seedOf(kFootprint);
        if (const std::optional<PartPoints> points = parts.pointsOf(texels[lane], seed))
          ofWaves[w].push_back({wave.start + static_cast<std::uint32_t>(lane), *points});
      });
    }
  });
  if (progress.cancelled()) return interrupted();
  std::vector<DividedTexel> all;
  for (const std::vector<DividedTexel>& found : ofWaves) all.insert(all.end(), found.begin(), found.end());
  return all;
}

Expected<void> warmUp(const GatherScene& scene, GatherState& state, Progress& progress) {
  const std::size_t count = scene.map.size();
  WarmLinks links(count, scene.waves.size());
  std::vector<Vec3> first(count);     // light that needs no texel to be known: direct, and what rays see shine
  std::vector<Vec3> constant(count);  // the same and light from hits without texels
  state.uneven.resize(count);
  auto traced = forEachWave(0, scene.waves.size(), state, progress, [&](std::size_t w, GatheredWave& counts) {
    const Wave& wave = scene.waves[w];
    const std::size_t linkCount = std::size_t{wave.count} * kWarmRays;
    WarmWave texels(scene, wave.page, wave.first, wave.count);
    std::array<CacheLink, std::size_t{kLanes} * kWarmRays> found;
    const auto warm = texels.warmUp(std::span(found).first(linkCount), counts);
    links.keep(w, std::size_t{wave.start} * kWarmRays, std::span(found).first(linkCount));
    for (std::size_t i = 0; i < wave.count; ++i) {
      const std::size_t t = wave.start + i;
      state.reflectance[t] = packColor(warm[i].reflectance);
      first[t] = warm[i].direct + warm[i].seen;
      constant[t] = first[t] + warm[i].relit;
      state.backFaces[t] = static_cast<std::uint32_t>(std::popcount(warm[i].backs));
      state.uneven[t] = warm[i].isUneven() ? 1 : 0;
      if (!scene.leavesLightOut()) continue;
      state.direct[t] = scene.indirectOnly ? warm[i].direct : warm[i].hidden;
      if (!scene.indirectOnly) continue;
      state.seen[t] = warm[i].seen * static_cast<float>(kWarmRays);
    }
  });
  if (!traced) return traced;
  for (const DividedTexel& texel : scene.divided) state.uneven[texel.texel] = 1;
  std::fill(state.samplesOf.begin(), state.samplesOf.end(), std::uint32_t{kWarmRays});
  findBuried(scene, state);
  Sweeping(scene, state, links, std::move(first), constant).run();
  for (std::size_t t = 0; t < count; ++t)
    if (!state.buried[t]) {
      state.backFaces[t] = 0;
      state.samplesOf[t] = 0;
    }
  return {};
}

}  // namespace lumel
