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
/// Without a target a texel is done at kSettledError * N^kSettledRate times the root of its light and the mean light, N
/// being all samples: what is seen of an error goes with the root of the light, and a texel of mean light has about
/// this error after N samples. In the dark, where somebody may stand whose eyes have adapted, at no more than
/// kSettledInDark times as much relative to its light; below kSettledFloor of the mean it is night.
constexpr double kSettledError = 0.4;
constexpr double kSettledRate = -0.6;
constexpr double kSettledInDark = 5.0;
constexpr double kSettledFloor = 1e-3;

/// How much larger the worst map's error is than the flat one's, around a wave, by how far both moved.
double worstByFlat(const Waves& waves, const GatherState& state, std::size_t wave) {
  std::array<double, 1 + kMostMaps> moved{};
  for (const std::uint32_t near : waves.around(wave))
    if (near != Waves::kNone)
      for (std::size_t map = 0; map < moved.size(); ++map)
        moved[map] += static_cast<double>(state.waves[near].moved[map]);
  return moved[0] > 0.0 ? std::sqrt(std::ranges::max(moved) / moved[0]) : 1.0;
}

/// Standard error at which a texel of this light is done.
double goalOf(const GatherOptions& options, double light, double mean) {
  if (options.targetError > 0.0f) return static_cast<double>(options.targetError) * std::max(light, kDarkFloor * mean);
  const double settled = kSettledError * std::pow(static_cast<double>(options.samples), kSettledRate);
  light = std::max(light, kSettledFloor * mean);
  return settled * std::min(std::sqrt(light * mean), kSettledInDark * light);
}

}  // namespace

double markDone(const GatherScene& scene, const GatherOptions& options, GatherState& state) {
  const double mean = state.meanLuminance();
  std::size_t met = 0;
  std::vector<std::uint8_t> meets(scene.waves.size());
  for (std::size_t w = 0; w < scene.waves.size(); ++w) {
    const Wave& wave = scene.waves[w];
    const double worst = worstByFlat(scene.waves, state, w);
    std::size_t metHere = 0;
    for (std::size_t i = 0; i < wave.count; ++i) {
      const std::size_t t = wave.start + i;
      const bool inside = options.targetError > 0.0f && 2 * state.backFaces[t] > state.samplesOf[t];
      metHere += inside || worst * static_cast<double>(state.errorOf(scene.waves, w, i)) <=
                               goalOf(options, static_cast<double>(luminance(state.meanLight(t))), mean);
    }
    meets[w] = state.waves[w].done || metHere == wave.count;
    met += metHere;
  }
  const auto unmet = [&](std::uint32_t near) { return near != Waves::kNone && !meets[near]; };
  for (std::size_t w = 0; w < scene.waves.size(); ++w) {
    std::uint32_t& done = state.waves[w].done;
    done = meets[w] && (done || std::ranges::count_if(scene.waves.around(w), unmet) <= kMostUnmetAround) ? 1 : 0;
  }
  const std::size_t count = scene.waves.texels();
  return count == 0 ? 1.0 : static_cast<double>(met) / static_cast<double>(count);
}

}  // namespace lumel
