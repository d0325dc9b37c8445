// Unbiased path tracing of the light that reaches texels: a wave of up to 16 texels advances in step, one lane each,
// so that every ray call is a packet.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/light_transport.h"
#include "baker/path/texel_sums.h"
#include "baker/rays/non_finite.h"
#include "lightmap/maps/encoding.h"
#include "lightmap/maps/projection_probe.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

struct PathOptions {
  int samples = 1;
  int bounces = 0;  // -1: all
  bool indirectOnly = false;
  std::uint64_t seed = 1;
};

/// Without a number of bounces Russian roulette alone ends paths, so the estimate is unbiased wherever albedo is
/// below 1. Light between surfaces of albedo 1 never dies: a path is cut off after so many hits that take nothing from
/// it, and is counted (WaveResult::cutPaths).
inline constexpr int kMostLosslessHits = 4096;

/// Stores the result of a path-traced texel.
struct TexelResult {
  TexelSums sums;
  float coverage = 0.0f;  // area share; 0: nothing was sampled
  bool probed = false;
  std::array<Vec3d, kProbeNormals> probes{};  // sums of light on probeNormals(), where probed
};

/// Stores the results of a wave, texels by lane.
struct WaveResult {
  std::array<TexelResult, kLanes> texels;
  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::uint64_t cutPaths = 0;  // ended by force (kMostLosslessHits): what they would have found is missing
  std::vector<NonFiniteSample> nonFinite;
};

class PathIntegrator {
 public:
  /// Keeps references to all of its arguments.
  PathIntegrator(const LightTransport& transport, const Encoding& encoding, const Atlas& atlas,
                 const PathOptions& options);

  /// Samples texels [first, first + count) of `page`, count <= kLanes. Every kProbeStride-th texel of the page is
  /// probed. The result depends on the arguments alone, never on the thread.
  WaveResult bakeWave(std::uint32_t pageIndex, const PageTexels& page, std::size_t first, std::size_t count) const;

  /// The same for any texels of the page, at most kLanes. `scrambles`: empty, or one for each, so that a texel can be
  /// sampled again and again by other paths.
  WaveResult traceTexels(std::uint32_t pageIndex, const PageTexels& page, std::span<const std::uint32_t> texels,
                         std::span<const std::uint32_t> scrambles) const;

 private:
  const LightTransport& transport_;
  const Encoding& encoding_;
  const Atlas& atlas_;
  PathOptions options_;
};

}  // namespace lumel
