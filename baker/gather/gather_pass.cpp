#include "baker/gather/gather_pass.h"

#include <algorithm>
#include <span>

#include "baker/gather/each_wave.h"
#include "baker/gather/stopping.h"
#include "baker/gather/waves/gather_wave.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr std::size_t kTexelGrain = 4096;
/// Whether more or less than half of a texel's rays meet backs is certain where the lead squared, in rays, is this many
/// times their number: 2.8 standard deviations of a fair coin, and what eight rays of eight have.
constexpr double kCertain = 8.0;
/// Inside of something whose chart nobody sees texels no brighter than this share of their place need no more samples.
constexpr float kDarkInside = 0.01f;

float square(float x) { return x * x; }

/// Luminances of a texel's maps as they would be stored after `samples`.
void storedMaps(const Encoding& encoding, const TexelLight& sums, std::size_t texel, std::uint32_t samples,
                std::size_t lane, DoublingError::MapMeans& stored) {
  std::array<Vec3, kMostMaps> maps{};
  const float scale = 1.0f / static_cast<float>(std::max(1u, samples));
  for (std::size_t k = 0; k < sums.maps.size(); ++k) maps[k] = sums.maps[k][texel] * scale;
  encoding.finish(std::span(maps).first(sums.maps.size()), sums.flat[texel] * scale);
  for (std::size_t k = 0; k < sums.maps.size(); ++k) stored[k][lane] = luminance(maps[k]);
}

/// Adds what a wave gathered in samples [first, end).
void store(const GatherScene& scene, GatherState& state, std::size_t index, const GatheredWave& gathered,
           std::uint32_t first, std::uint32_t end) {
  const Wave& wave = scene.waves[index];
  std::array<float, 1 + kMostMaps>& moved = state.waves[index].moved;
  moved = {};
  std::array<float, kLanes> before{};
  std::array<float, kLanes> now{};
  DoublingError::MapMeans mapsBefore{}, mapsNow{};
  std::uint32_t leftOut = 0;
  for (std::size_t i = 0; i < wave.count; ++i) {
    const GatheredTexel& texel = gathered.texels[i];
    const std::size_t t = wave.start + i;
    if (state.buried[t]) {
      leftOut |= 1u << i;
      continue;
    }
    state.samplesOf[t] = end;
    Vec3& flat = state.sums.flat[t];
    before[i] = luminance(flat) / static_cast<float>(std::max(1u, first));
    storedMaps(scene.encoding, state.sums, t, first, i, mapsBefore);
    flat += Vec3(texel.flat);
    if (!state.seen.empty()) state.seen[t] += Vec3(texel.seen);
    now[i] = luminance(flat) / static_cast<float>(end);
    moved[0] += square(now[i] - before[i]);
    for (std::size_t k = 0; k < state.sums.maps.size(); ++k) {
      Vec3& sum = state.sums.maps[k][t];
      const float mean = luminance(sum) / static_cast<float>(std::max(1u, first));
      sum += Vec3(texel.maps[k]);
      moved[k + 1] += square(luminance(sum) / static_cast<float>(end) - mean);
    }
    storedMaps(scene.encoding, state.sums, t, end, i, mapsNow);
    if (!scene.levels.endless)
      for (std::size_t l = 0; l < scene.stored(); ++l) state.levelSums[t * scene.stored() + l] += Vec3(texel.levels[l]);
    if ((wave.first + i) % kProbeStride == 0)
      for (std::size_t k = 0; k < kProbeNormals; ++k)
        state.probes[scene.waves.probeOf(wave.page, wave.first + i)][k] += Vec3(texel.probes[k]);
    if (state.covers[t] != Cover::Open) state.backFaces[t] += texel.backFaces;
  }
  state.errors.add(scene.waves, index, before, now, first, end - first, leftOut);
  state.errors.addMaps(scene.waves, index, mapsBefore, mapsNow, first, end - first, leftOut);
  state.waves[index].samples = end;
}

/// Mean luminance of the waves around one.
float lightAround(const GatherScene& scene, const GatherState& state, std::size_t wave) {
  double light = 0.0, texels = 0.0;
  for (const std::uint32_t near : scene.waves.around(wave)) {
    if (near == Waves::kNone) continue;
    for (std::size_t t = scene.waves[near].start; t < scene.waves[near].start + scene.waves[near].count; ++t)
      light += static_cast<double>(luminance(state.meanLight(t)));
    texels += scene.waves[near].count;
  }
  return static_cast<float>(light / texels);
}

/// Without bounces nothing is known of what a texel sees.
void findPlacesAround(const GatherScene& scene, GatherState& state) {
  parallelFor(scene.waves.size(), kTexelGrain / kLanes, [&](std::size_t first, std::size_t last) {
    for (std::size_t w = first; w < last; ++w)
      std::fill_n(state.places.begin() + scene.waves[w].start, scene.waves[w].count, lightAround(scene, state, w));
  });
}

/// Irradiance / pi as of level `level`, from all samples so far.
Vec3 lightOf(const GatherScene& scene, const GatherState& state, std::size_t texel, std::size_t level) {
  const Vec3& sum = scene.levels.endless ? state.sums.flat[texel] : state.levelSums[texel * scene.stored() + level];
  const float weight = state.weightOf(texel);
  const Vec3 gathered = sum / weight;
  if (!scene.leavesLightOut()) return gathered;
  return gathered + state.direct[texel] + state.seen[texel] / (static_cast<float>(kWarmRays) + weight);
}

}  // namespace

Expected<void> gatherPass(const GatherScene& scene, GatherState& state, std::size_t firstWave, std::size_t lastWave,
                          Progress& progress) {
  const std::uint32_t first = state.samples, end = state.openEnd;
  return forEachWave(firstWave, lastWave, state, progress, [&](std::size_t w, GatheredWave& done) {
    const Wave& wave = scene.waves[w];
    GatherState::OfWave& known = state.waves[w];
    if (!known.done && known.samples >= end) return;
    if (!known.done) {
      const std::span buried = std::span(state.buried).subspan(wave.start, wave.count);
      // Without bounces they change from pass to pass.
      std::span<const float> places;
      if (scene.levels.count > 0) places = std::span(state.places).subspan(wave.start, wave.count);
      if (first == 0 || std::ranges::count(buried, 0) > 0) {
        GatherWave texels(scene, wave.page, wave.first, wave.count, known.sampled);
        texels.gather(first, end, state.radiance, buried, places, state.spreadsOf(scene, w), done);
        for (std::size_t i = 0; i < wave.count; ++i) state.coverage[wave.start + i] = texels.coverage(i);
      }
      store(scene, state, w, done, first, end);
    }
    progress.advance(std::uint64_t{wave.count} * (end - first));
  });
}

void closePass(const GatherScene& scene, GatherState& state) {
  state.samples = state.openEnd;
  state.openEnd = 0;
  std::stable_sort(state.nonFinite.begin() + static_cast<std::ptrdiff_t>(state.closedNonFinite), state.nonFinite.end(),
                   [](const auto& a, const auto& b) { return a.wave < b.wave; });
  state.closedNonFinite = state.nonFinite.size();
  if (scene.levels.count == 0) findPlacesAround(scene, state);
  findBuried(scene, state);
  std::vector<std::uint8_t> live(state.waves.size());
  for (std::size_t w = 0; w < live.size(); ++w) live[w] = state.waves[w].done ? 0 : 1;
  state.errors.endPass(scene.waves, live, state.places);
}

std::vector<TexelMap::Substitute> substitutesFor(const GatherScene& scene, const GatherState& state) {
  std::vector<std::uint8_t> valid(scene.map.size());
  std::vector<std::uint8_t> wanting(scene.map.size());
  for (std::size_t t = 0; t < valid.size(); ++t) {
    valid[t] = 2 * state.backFaces[t] <= state.samplesOf[t] ? 1 : 0;
    // Of texels wholly inside only rays from inside see anything, and these must not bring the light out there to
    // texels that are partly in the open.
    wanting[t] = 16.0 * state.backFaces[t] < 15.0 * state.samplesOf[t] ? 1 : 0;
  }
  return scene.map.substitutes(wanting, valid);
}

/// Judges texels most of whose rays met backs, each once: the backs of covers that are seen from the open do not count.
static void judgeCovers(const GatherScene& scene, GatherState& state) {
  parallelFor(scene.texels.size(), 1, [&](std::size_t firstPage, std::size_t lastPage) {
    for (std::size_t p = firstPage; p < lastPage; ++p) {
      const std::size_t start = scene.map.firstOfPage(p), count = scene.texels[p].size();
      std::vector<std::uint8_t> asked(count), seen(count), open(count);
      for (std::size_t i = 0; i < count; ++i) {
        const double lead = 2.0 * state.backFaces[start + i] - state.samplesOf[start + i];
        asked[i] = lead > 0.0 && state.covers[start + i] == Cover::Unknown ? 1 : 0;
        seen[i] = lead < 0.0 && lead * lead >= kCertain * state.samplesOf[start + i] ? 1 : 0;
      }
      if (std::ranges::count(asked, 1) == 0) continue;
      TexelParts(scene.transport.rays, scene.transport.materials, scene.atlas, scene.texels[p])
          .findOpen(asked, seen, open);
      for (std::size_t i = 0; i < count; ++i) {
        if (asked[i] != 0) state.covers[start + i] = open[i] != 0 ? Cover::Open : Cover::Inside;
        if (asked[i] != 0 && open[i] != 0) state.backFaces[start + i] = 0;
      }
    }
  });
}

void findBuried(const GatherScene& scene, GatherState& state) {
  judgeCovers(scene, state);
  std::vector<std::uint8_t> hidden(scene.map.size());
  std::vector<std::uint8_t> valid(scene.map.size());
  for (std::size_t t = 0; t < valid.size(); ++t) {
    const double lead = 2.0 * state.backFaces[t] - state.samplesOf[t];  // of rays that meet backs
    const bool certain = lead * lead >= kCertain * state.samplesOf[t];
    hidden[t] = certain && lead > 0.0 ? 1 : 0;
    valid[t] = certain && lead < 0.0 ? 1 : 0;
  }
  const std::vector<std::uint8_t> replaced = scene.map.buried(hidden, valid);
  for (std::size_t t = 0; t < hidden.size(); ++t) {
    const bool judged = hidden[t] && state.samplesOf[t] >= kFirstJudged;
    if (replaced[t] || (judged && luminance(state.meanLight(t)) <= kDarkInside * state.places[t])) state.buried[t] = 1;
  }
}

void renewCache(const GatherScene& scene, GatherState& state) {
  const auto substitutes = substitutesFor(scene, state);
  const std::size_t stored = scene.stored();
  // The lowest level stays as the warm-up left it where it stands on others that are not kept.
  const std::size_t firstLevel = scene.levels.base > 0 ? 1 : 0;
  const auto renew = [&](std::size_t texel, std::size_t source) {
    for (std::size_t l = firstLevel; l < stored; ++l)
      state.radiance[texel * stored + l] =
          packColor(unpackColor(state.reflectance[texel]) * lightOf(scene, state, source, l));
  };
  parallelFor(scene.map.size(), kTexelGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) renew(t, t);
  });
  for (const TexelMap::Substitute& s : substitutes) renew(s.texel, s.source);
}

}  // namespace lumel
