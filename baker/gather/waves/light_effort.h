// How many light samples a wave of texels takes of each strategy: more where they still differ, fewer where all of
// them found the light, or none did. The same for all texels of the wave, so that its rays stay in step.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "baker/light/direct_light.h"
#include "baker/rays/lanes.h"

namespace lumel {

/// What a wave learnt of one source of light; luminance on the flat map.
struct LightSpread {
  float variance = 0.0f;    // of one sample, mean over the wave's texels
  float unshadowed = 0.0f;  // mean square of what samples would bring were nothing in the way
  float mean = 0.0f;
  float samples = 0.0f;  // per texel
  int power = 0;         // the source is sampled 2^power times per gather ray
};

/// The sums of a net of samples for one source, before they enter its LightSpread.
struct LightTally {
  std::array<float, kLanes> sum{};
  std::array<float, kLanes> squares{};
  float unshadowed = 0.0f;

  void add(std::size_t lane, float luminance) {
    sum[lane] += luminance;
    squares[lane] += luminance * luminance;
  }
  /// `samples` of each of `texels` texels.
  void enter(LightSpread& spread, std::uint32_t samples, std::size_t texels) const;
};

/// A bake's samples fall into stretches by their numbers: [0, 8), [8, 64), [64, ...). Each has scrambles of its own,
/// and how often its lights are sampled depends on the stretches before alone: on no sample that it weighs, nor on one
/// that its own sequence evades. So every stretch is unbiased given those before it.
inline constexpr std::array<std::uint32_t, 2> kLightStretches = {8, 64};
std::uint32_t lightStretch(std::uint32_t sample);
inline bool startsLightStretch(std::uint32_t sample) {
  return sample == kLightStretches[0] || sample == kLightStretches[1];
}
/// Whether a later stretch learns from this sample.
inline bool isPilot(std::uint32_t sample) { return sample < kLightStretches.back(); }

/// How often to sample a strategy, as a power of two of samples per gather ray: from an eighth to four. To get most
/// for the rays, samples go in proportion to the standard deviation of one over the root of its cost (Neyman 1934);
/// gather rays are the measure, or where they hardly differ kSmoothEnough of the light itself. A strategy whose samples
/// all agreed keeps a small variance, since the next may be the first to differ. `all`: the strategies, and last the
/// gather rays.
int lightPower(std::span<const LightSpread> all, std::size_t strategy);

/// Returns how hits near a wave's texels choose among punctual lights: by what the wave's own light samples have seen
/// arrive. `strategies` and `spreads` as GatherWave::gather has them; empty: nothing is known.
PunctualChoice punctualChoice(const PunctualLights& lights, std::span<const LightStrategy> strategies,
                              std::span<const LightSpread> spreads);

/// n * 2^power, rounded down.
inline std::uint32_t scaledBy(int power, std::uint32_t n) { return power >= 0 ? n << power : n >> -power; }

}  // namespace lumel
