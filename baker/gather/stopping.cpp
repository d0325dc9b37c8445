#include "baker/gather/stopping.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lumel {
namespace {

/// A wave that meets the target goes on with more than so many of the eight around it that do not (a straight border
/// has three): estimates scatter, and waves that stop by themselves would show as streaks in the sample counts.
constexpr std::ptrdiff_t kMostUnmetAround = 3;
/// Without a target a texel is done at kSettledError * N^kSettledRate times the root of its light and that of its
/// place, N being all samples: what is seen of an error goes with the root of the light, and a texel as bright as its
/// place has about this error after N samples. In the dark, where somebody may stand whose eyes have adapted, at no
/// more than kSettledInDark times as much relative to its light; below kSettledFloor of the place's light it is night.
constexpr double kSettledError = 0.4;
constexpr double kSettledRate = -0.6;
constexpr double kSettledInDark = 5.0;
constexpr double kSettledFloor = 1e-3;

/// How much larger the worst map's error is than the flat one's, around a wave, by how far both moved.
double worstByFlat(const Waves& waves, const GatherState& state, std::size_t wave) {
  std::array<double, 1 + kMostMaps> moved{};
  for (const std::uint32_t near : waves.around(wave)) {
    if (near == Waves::kNone || !(state.errors.ofWaves[near].place > 0.0)) continue;
    for (std::size_t map = 0; map < moved.size(); ++map)
      moved[map] += static_cast<double>(state.waves[near].moved[map]) / state.errors.ofWaves[near].place;
  }
  return moved[0] > 0.0 ? std::sqrt(std::ranges::max(moved) / moved[0]) : 1.0;
}

/// Standard error at which a texel of this light is done, in a place of that light.
double goalOf(const GatherOptions& options, double light, double place) {
  if (options.targetError > 0.0f) return static_cast<double>(options.targetError) * std::max(light, kDarkFloor * place);
  const double settled = kSettledError * std::pow(static_cast<double>(options.samples), kSettledRate);
  light = std::max(light, kSettledFloor * place);
  return settled * std::min(std::sqrt(light * place), kSettledInDark * light);
}

}  // namespace

bool markDone(const GatherScene& scene, const GatherOptions& options, GatherState& state) {
  const bool hasTarget = options.targetError > 0.0f;
  std::vector<std::uint32_t> met(scene.waves.size());  // texels
  for (std::size_t w = 0; w < met.size(); ++w) {
    const Wave& wave = scene.waves[w];
    const double worst = worstByFlat(scene.waves, state, w);
    for (std::size_t i = 0; i < wave.count; ++i) {
      const std::size_t t = wave.start + i;
      const bool inside = hasTarget && 2 * state.backFaces[t] > state.samplesOf[t];
      const auto light = static_cast<double>(luminance(state.meanLight(t)));
      // Where the warm-up found no light a texel is a place of its own.
      const double place = state.places[t] > 0.0f ? static_cast<double>(state.places[t]) : light;
      const double goal = goalOf(options, light, place);
      const bool isNight = !(place > 0.0);
      met[w] += inside || isNight || worst * static_cast<double>(state.errorOf(scene.waves, w, i)) <= goal ? 1 : 0;
    }
    if (state.waves[w].done) met[w] = wave.count;
  }
  bool all = true;
  for (std::size_t w = 0; w < met.size(); ++w) {
    std::uint32_t metAround = 0, texels = 0;
    std::ptrdiff_t unmet = 0;
    for (const std::uint32_t near : scene.waves.around(w)) {
      if (near == Waves::kNone) continue;
      metAround += met[near];
      texels += scene.waves[near].count;
      if (met[near] < scene.waves[near].count) ++unmet;
    }
    const bool settled = met[w] == scene.waves[w].count && unmet <= kMostUnmetAround;
    const bool share = hasTarget && metAround >= kTargetShare * texels;
    if (settled || share) state.waves[w].done = 1;
    all = all && state.waves[w].done;
  }
  return all;
}

}  // namespace lumel
