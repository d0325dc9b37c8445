#include "baker/gather/warm_up.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "baker/gather/each_wave.h"
#include "baker/gather/gather_pass.h"
#include "baker/gather/warm_links.h"
#include "baker/gather/warm_sweeps.h"
#include "baker/gather/waves/warm_wave.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// What a texel sees reaches so many steps along the links: to what its rays found, and to what is found from there.
constexpr int kSeenSteps = 2;
/// Light is followed back over so many bounces to where it came from.
constexpr int kSourceSteps = 8;
constexpr std::size_t kWaveGrain = 256;

/// Replaces of[t], for every texel, by find(t, sum of of[] over the texels that its links lead to, how many these are).
template <class Value, class Find>
void passAlong(const GatherScene& scene, const WarmLinks& links, std::vector<Value>& of, Find find) {
  std::vector<Value> found(of.size());
  parallelFor(scene.waves.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w) {
      const std::size_t start = scene.waves[w].start;
      WarmLinks::Reader link(links, w, start * kWarmRays);
      for (std::size_t t = start; t < start + scene.waves[w].count; ++t) {
        Value sum(0.0f);
        float count = 0.0f;
        for (int ray = 0; ray < kWarmRays; ++ray, link.next()) {
          if (!link.isTexel()) continue;
          sum += of[link.texel()];
          count += 1.0f;
        }
        found[t] = find(t, sum, count);
      }
    }
  });
  of.swap(found);
}

/// Finds GatherState::places. `light`: irradiance / pi of the texels.
void findPlaces(const GatherScene& scene, const WarmLinks& links, std::span<const Vec3> light, GatherState& state) {
  std::vector<float>& places = state.places;
  for (std::size_t t = 0; t < places.size(); ++t) {
    Vec3 shown = light[t];
    if (scene.leavesLightOut()) shown -= state.direct[t] + state.seen[t] / static_cast<float>(kWarmRays);
    places[t] = std::max(0.0f, luminance(shown));
  }
  for (int step = 0; step < kSeenSteps; ++step)
    passAlong(scene, links, places,
              [&](std::size_t t, float sum, float count) { return (places[t] + sum) / (1.0f + count); });
  // What a texel reflects, and that times the light of the place that it came from.
  std::vector<Vec2> passed(places.size());
  const auto reflected = [&](std::size_t t, float source) {
    const float all = luminance(unpackColor(state.reflectance[t]) * light[t]);
    return Vec2(all, all * source);
  };
  for (std::size_t t = 0; t < passed.size(); ++t) passed[t] = reflected(t, places[t]);
  const auto sourceOf = [&](std::size_t t, const Vec2& sum) {
    const Vec2 found = sum / static_cast<float>(kWarmRays);
    const float all = std::max(luminance(light[t]), found.x);
    return all > 0.0f ? ((all - found.x) * places[t] + found.y) / all : places[t];
  };
  for (int step = 1; step < kSourceSteps; ++step)
    passAlong(scene, links, passed,
              [&](std::size_t t, const Vec2& sum, float) { return reflected(t, sourceOf(t, sum)); });
  std::vector<float> sources(places.size());
  for (std::size_t t = 0; t < sources.size(); ++t)
    sources[t] = passed[t].x > 0.0f ? passed[t].y / passed[t].x : places[t];
  places.swap(sources);
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
  std::vector<Vec3> first(count);  // light that needs no texel to be known: direct, and what rays see shine
  std::vector<Vec3> relit(count);  // light from hits without texels
  state.uneven.resize(count);
  auto traced = forEachWave(0, scene.waves.size(), state, progress, [&](std::size_t w, GatheredWave& counts) {
    const Wave& wave = scene.waves[w];
    const std::size_t linkCount = std::size_t{wave.count} * kWarmRays;
    WarmWave texels(scene, wave.page, wave.first, wave.count);
    std::array<CacheLink, std::size_t{kLanes} * kWarmRays> found;
    const auto warm = texels.warmUp(std::span(found).first(linkCount), counts);
    state.waves[w].sampled = texels.sampled();
    links.keep(w, std::size_t{wave.start} * kWarmRays, std::span(found).first(linkCount));
    for (std::size_t i = 0; i < wave.count; ++i) {
      const std::size_t t = wave.start + i;
      state.reflectance[t] = packColor(warm[i].reflectance);
      first[t] = warm[i].direct + warm[i].seen;
      relit[t] = warm[i].relit;
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
  WarmSweeps sweeps(scene, state, links, std::move(first), std::move(relit));
  sweeps.run();
  findPlaces(scene, links, sweeps.light(), state);
  for (std::size_t t = 0; t < count; ++t)
    if (!state.buried[t]) {
      state.backFaces[t] = 0;
      state.samplesOf[t] = 0;
    }
  return {};
}

}  // namespace lumel
