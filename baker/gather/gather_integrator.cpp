#include "baker/gather/gather_integrator.h"

#include <algorithm>
#include <utility>

#include "baker/gather/gather_pass.h"
#include "baker/gather/stopping.h"
#include "baker/gather/warm_up.h"
#include "scene/base/parallel.h"
#include "scene/base/stopwatch.h"

namespace lumel {
namespace {

constexpr std::size_t kTexelGrain = 4096;
/// Longest path through surfaces without texels, where bounces have no end of their own.
constexpr int kLongestPath = 64;

CacheLevels levelsFor(int bounces) {
  if (bounces < 0) return {.count = 1, .base = 0, .endless = true};
  const int count = std::min(bounces, CacheLevels::kMost);
  return {.count = count, .base = bounces - count, .endless = false};
}

}  // namespace

GatherIntegrator::GatherIntegrator(const LightTransport& transport, const Encoding& encoding, const Atlas& atlas,
                                   const std::vector<PageTexels>& texels, const GatherOptions& options)
    : options_(options),
      map_(transport.rays, atlas, texels),
      waves_(texels),
      scene_{.transport = transport,
             .encoding = encoding,
             .atlas = atlas,
             .texels = texels,
             .map = map_,
             .waves = waves_,
             .seed = options.seed,
             .bounces = options.bounces,
             .lastDepth = options.bounces < 0 ? kLongestPath : options.bounces,
             .levels = levelsFor(options.bounces),
             .indirectOnly = options.indirectOnly} {
  if (!options.indirectOnly) scene_.strategies = lightStrategies(transport.atTexels(), true);
}

std::uint32_t GatherIntegrator::mostSamples() const {
  const int most = options_.targetError > 0.0f ? std::max(options_.samples, options_.maxSamples) : options_.samples;
  return static_cast<std::uint32_t>(most);
}

Expected<void> GatherIntegrator::run(GatherState& state, Progress& progress, const GatherPauses& pauses) {
  if (!state.fits(scene_)) return inputError("the state of the bake is that of another; bake from the beginning");
  const Stopwatch sinceStart;
  const std::function<double()> clock = [&, before = state.seconds] {
    return state.seconds = before + sinceStart.seconds();
  };
  const std::uint32_t samples = mostSamples();
  progress.begin("bake", map_.size() * std::uint64_t{samples});
  progress.advance(state.samplesTaken(scene_));
  if (auto warm = warmUpIfCold(state, progress); !warm) return warm;
  while (state.samples < samples) {
    if (state.openEnd == 0) {
      const std::uint32_t end = std::min(samples, std::max(kFirstPass, 2 * state.samples));
      const double expected = state.secondsPerSample * (end - state.samples);
      state.passBegan = clock();
      if (options_.timeBudgetSeconds > 0.0 && state.samples > 0 &&
          state.passBegan + expected > options_.timeBudgetSeconds)
        break;
      state.openEnd = end;
    }
    if (auto done = gatherOpenPass(state, progress, pauses, clock); !done) return done;
    if (isDone(state)) break;
    if (scene_.levels.count > 0 && state.samples < samples) renewCache(scene_, state);
  }
  progress.end();
  return {};
}

/// After it the cache is as the state says.
Expected<void> GatherIntegrator::warmUpIfCold(GatherState& state, Progress& progress) {
  auto divided = findDivided(scene_, progress);
  if (!divided) return divided.error();
  divided_ = std::move(*divided);
  scene_.divided = divided_;
  if (!state.isWarm) {
    if (scene_.levels.count > 0)
      if (auto warm = warmUp(scene_, state, progress); !warm) {
        state = begin();
        return warm;
      }
    state.makeSums(scene_);
    state.isWarm = 1;
  }
  if (scene_.levels.count > 0) map_.setUneven(state.uneven);
  scene_.reflectance = state.reflectance;
  return {};
}

/// Whether nothing is left to gather of the open pass for waves [first, last). What is left out of it is reported then.
bool GatherIntegrator::skipsTaken(const GatherState& state, std::size_t first, std::size_t last,
                                  Progress& progress) const {
  std::uint64_t leftOut = 0;
  for (std::size_t w = first; w < last; ++w) {
    if (!state.waves[w].done && state.waves[w].samples < state.openEnd) return false;
    if (state.waves[w].done) leftOut += waves_[w].count;
  }
  progress.advance(leftOut * (state.openEnd - state.samples));
  return true;
}

/// Gathers what is left of the open pass, and closes it.
Expected<void> GatherIntegrator::gatherOpenPass(GatherState& state, Progress& progress, const GatherPauses& pauses,
                                                const std::function<double()>& clock) {
  const std::uint32_t samples = state.openEnd - state.samples;
  std::size_t perPiece = waves_.size();
  if (pauses.goesOn)
    perPiece = static_cast<std::size_t>(std::max<std::uint64_t>(1, pauses.samplesPerPiece / kLanes / samples));
  for (std::size_t first = 0; first < waves_.size(); first += perPiece) {
    const std::size_t last = std::min(waves_.size(), first + perPiece);
    if (skipsTaken(state, first, last, progress)) continue;
    auto gathered = gatherPass(scene_, state, first, last, progress);
    clock();
    if (!gathered) return gathered;
    if (pauses.goesOn && !pauses.goesOn(state)) return interrupted();
  }
  closePass(scene_, state);
  state.secondsPerSample = (clock() - state.passBegan) / samples;
  return {};
}

/// Whether no more passes are needed.
bool GatherIntegrator::isDone(GatherState& state) const {
  if (options_.targetError > 0.0f)
    return state.samples >= std::max(kFirstJudged, static_cast<std::uint32_t>(options_.samples)) &&
           markDone(scene_, options_, state);
  if (options_.adaptive && state.samples >= kFirstJudged && state.samples < mostSamples())
    markDone(scene_, options_, state);
  return false;
}

TexelLight GatherIntegrator::takeLight(GatherState& state) const {
  TexelLight light = std::move(state.sums);
  parallelFor(waves_.texels(), kTexelGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) {
      const float scale = 1.0f / state.weightOf(t);
      light.flat[t] *= scale;
      for (std::vector<Vec3>& map : light.maps) map[t] *= scale;
    }
  });
  return light;
}

std::vector<float> GatherIntegrator::takeMapErrors(GatherState& state) const {
  const std::size_t maps = scene_.encoding.mapCount();
  std::vector<float> errors = state.errors.takeMapErrors(waves_, maps, state.places);
  parallelFor(waves_.texels(), kTexelGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t)
      for (std::size_t k = 0; k < maps; ++k)
        errors[t * maps + k] *= static_cast<float>(state.samplesOf[t]) / state.weightOf(t);
  });
  return errors;
}

BakedTexel GatherIntegrator::texel(const GatherState& state, std::uint32_t page, std::size_t index) const {
  const std::size_t t = numberOf(page, index);
  const float scale = 1.0f / state.weightOf(t);
  BakedTexel baked;
  baked.coverage = state.coverage[t];
  const auto taken = static_cast<float>(std::max(1u, state.samplesOf[t]));
  baked.validity = 1.0f - static_cast<float>(state.backFaces[t]) / taken;
  baked.standardError = state.errorOf(waves_, waves_.waveOf(page, index), index % kLanes);
  if (state.coverage[t] > 0.0f) baked.samples = state.samplesOf[t];
  baked.probed = index % kProbeStride == 0;
  if (baked.probed)
    for (std::size_t k = 0; k < kProbeNormals; ++k)
      baked.probes[k] = state.probes[waves_.probeOf(page, index)][k] * scale;
  return baked;
}

SurfaceCache GatherIntegrator::takeSurfaces(GatherState& state) {
  if (scene_.levels.count > 0) renewCache(scene_, state);
  SurfaceCache surfaces{.map = std::move(map_),
                        .levels = scene_.levels,
                        .bounces = scene_.bounces,
                        .lastDepth = scene_.lastDepth,
                        .reflectance = std::move(state.reflectance),
                        .radiance = std::move(state.radiance)};
  state.dropCache();
  return surfaces;
}

}  // namespace lumel
