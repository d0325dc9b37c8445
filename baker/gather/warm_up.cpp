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
  WarmSweeps(scene, state, links, std::move(first), std::move(relit)).run();
  for (std::size_t t = 0; t < count; ++t)
    if (!state.buried[t]) {
      state.backFaces[t] = 0;
      state.samplesOf[t] = 0;
    }
  return {};
}

}  // namespace lumel
