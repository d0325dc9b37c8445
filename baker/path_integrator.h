// Unbiased path tracing of the light that reaches texels: a wave of up to 16 texels advances in step, one lane each,
// so that every ray call is a packet.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "baker/light_transport.h"
#include "baker/texel_sums.h"
#include "lightmap/projection.h"
#include "lightmap/surface.h"
#include "lightmap/texels.h"

namespace lumel {

struct PathOptions {
  int samples = 1;
  int bounces = 0;
  bool indirectOnly = false;
  std::uint64_t seed = 1;
  bool stratumOrder = true;                  // take samples by cell (NetLanes): the same samples, faster rays
  TraceMode gatherMode = TraceMode::Packet;  // rays and shadow rays from texels
  TraceMode bounceMode = TraceMode::Packet;  // those from hits
};

/// A sample left out because it was not finite.
struct NonFiniteSample {
  std::uint32_t page = 0;
  TexelCoord texel;
  std::uint32_t sample = 0;
};

/// Tangent-space normals within 30 degrees of flat for which some texels also sum the true light, to judge the
/// projection.
inline constexpr std::size_t kProbeNormals = 7;
const std::array<Vec3, kProbeNormals>& probeNormals();

/// What became of one texel of a wave.
struct TexelResult {
  TexelSums sums;
  float coverage = 0.0f;  // area share; 0: nothing was sampled
  bool probed = false;
  std::array<Vec3d, kProbeNormals> probes{};  // sums of light on probeNormals(), where probed
};

struct WaveResult {
  std::array<TexelResult, kLanes> texels;
  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::vector<NonFiniteSample> nonFinite;
};

class PathIntegrator {
 public:
  /// Keeps references to all of its arguments.
  PathIntegrator(const LightTransport& transport, const RnmKernels& kernels, const Atlas& atlas,
                 const PathOptions& options);

  /// Samples texels [first, first + count) of `page`, count <= kLanes. Every kProbeStride-th texel of the page is
  /// probed. The result depends on the arguments alone, never on the thread.
  WaveResult bakeWave(std::uint32_t pageIndex, const PageTexels& page, std::size_t first, std::size_t count) const;

  static constexpr std::size_t kProbeStride = 64;

 private:
  const LightTransport& transport_;
  const RnmKernels& kernels_;
  const Atlas& atlas_;
  PathOptions options_;
};

}  // namespace lumel
