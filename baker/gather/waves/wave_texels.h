// The texels of one wave, ready to send rays and to take light samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "baker/gather/waves/gather_kernels.h"
#include "baker/gather/waves/gather_scene.h"
#include "baker/gather/waves/gather_tracer.h"
#include "baker/gather/waves/wave_points.h"
#include "baker/rays/sample_lanes.h"

namespace lumel {

/// Sample patterns of a texel; those of light samples come first.
enum TexelPattern : std::uint32_t {
  kFootprint = kLightPatterns,
  kDirection,
  kWarmDirection,
  kHits,
  kWarmHits,
  kLightStretch,
  kNearLight  // and one more for each further light
};

struct WaveTexels {
  /// Texels [firstTexel, firstTexel + texelCount) of a page, texelCount <= kLanes. Keeps a reference to `ofScene`.
  WaveTexels(const GatherScene& ofScene, std::uint32_t ofPage, std::size_t firstTexel, std::size_t texelCount);

  /// A ray of `rays` that starts from a texel.
  Flight flightOf(std::size_t lane, std::uint32_t sample, const PointLanes& from, const AimedRays& rays) const;

  const GatherScene& scene;
  std::uint32_t page;
  std::size_t first;
  std::size_t count;
  WavePoints points;
  std::array<TexelSampler, kLanes> samplers;
  std::array<bool, kLanes> covered{};
  SampleLanes lightSamples;
};

}  // namespace lumel
