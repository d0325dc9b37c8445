// Progressive final gather: texels gather the light that other texels are already known to reflect, instead of
// following every path to its end (Ward and Heckbert 1992, "Irradiance Gradients", keep such a cache at points chosen
// on the way; here the lightmap's texels are the points). Method, bias and figures: baker/README.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "baker/gather/gather_state.h"
#include "baker/gather/surface_cache.h"
#include "baker/gather/waves/gather_scene.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

/// What is stored of a texel beside its light.
struct BakedTexel {
  float coverage = 0.0f;
  float validity = 1.0f;
  float standardError = 0.0f;  // of the flat map's luminance; NaN: not known
  std::uint32_t samples = 0;
  bool probed = false;
  std::array<Vec3, kProbeNormals> probes{};  // mean light on probeNormals(), where probed
};

/// Lets a caller look at a gather between two pieces of work, from the thread that runs it: to write the state, or to
/// stop.
struct GatherPauses {
  std::function<bool(const GatherState&)> goesOn;  // called after each piece; false stops the gather. Empty: no pieces
  std::uint64_t samplesPerPiece = std::uint64_t{1} << 22;  // about a second of four cores
};

/// The light of all texels of an atlas. Every pass reads the cache that the passes before it left, and the cache is
/// renewed between passes: results do not depend on the number of threads.
///
/// 1. A direct map: kWarmLights light samples per texel.
/// 2. Warm-up: kWarmRays rays per texel are traced once and kept as links to the texels that they hit; the light of
///    one bounce after another is passed along them, without further rays.
/// 3. Gather: passes of 8, 8, 16, 32, ... samples per texel that continue one sequence. After each the cache is what
///    all of them found so far. Hits for which one value for a texel is too coarse (TexelMap) are shaded on the spot;
///    whose they are is learnt from the links' rays too.
///
/// With a given number of bounces N the cache holds levels, the light after 0, 1, ... N - 1 bounces, and one ray
/// serves all of them: level k of a texel adds what level k - 1 of the texel that it hit reflects, so the result has
/// exactly N bounces. Of more than CacheLevels::kMost levels the highest are kept, and the lowest of these stays as the
/// warm-up left it.
///
/// Texels inside of something (clearly more than half of their rays so far meet backs of single-sided surfaces) are no
/// longer gathered for where their chart has valid ones: what becomes of them is the finishing's business. Where their
/// chart has none, those that stay dark are not. Of other texels the parts that are inside do not count: the mean is
/// over samples from footprint points in the open.
///
/// Errors: DoublingError. Whether a texel is done is told by the flat map's and by how much farther the worst map moved
/// around the wave: stopping.h.
class GatherIntegrator {
 public:
  /// Samples of the first pass; once they are doubled errors are known.
  static constexpr std::uint32_t kFirstPass = 8;

  /// Keeps references to its arguments.
  GatherIntegrator(const LightTransport& transport, const Encoding& encoding, const Atlas& atlas,
                   const std::vector<PageTexels>& texels, const GatherOptions& options);

  /// A gather that has not begun.
  GatherState begin() const { return GatherState(scene_); }
  /// For writeState and readState.
  std::uint64_t key() const { return gatherKey(scene_, options_); }

  /// Goes on to the end from any state of this gather: from begin(), or from what was left when it stopped. Errors:
  /// Interrupted (the user or `pauses` stopped it; `state` can be gone on from), Input (`state` is of another gather).
  Expected<void> run(GatherState& state, Progress& progress, const GatherPauses& pauses = {});

  /// After run. takeLight once: the light leaves the state.
  TexelLight takeLight(GatherState& state) const;
  BakedTexel texel(const GatherState& state, std::uint32_t page, std::size_t index) const;
  /// Standard errors of the luminance of the encoding's maps, as Encoding::finish leaves them, texel by texel; NaN: not
  /// known. Once: they leave the state.
  std::vector<float> takeMapErrors(GatherState& state) const;
  /// Number of a page's texel among those of all pages.
  std::size_t numberOf(std::size_t page, std::size_t index) const {
    return waves_[waves_.waveOf(page, index)].start + index % kLanes;
  }

  /// After run, instead of GatherState::dropCache: what the surfaces reflect, by all samples. The cache leaves the
  /// state, and the integrator is of no more use for gathering.
  SurfaceCache takeSurfaces(GatherState& state);

 private:
  Expected<void> warmUpIfCold(GatherState& state, Progress& progress);
  Expected<void> gatherOpenPass(GatherState& state, Progress& progress, const GatherPauses& pauses,
                                const std::function<double()>& clock);
  bool skipsTaken(const GatherState& state, std::size_t first, std::size_t last, Progress& progress) const;
  bool isDone(GatherState& state) const;
  std::uint32_t mostSamples() const;

  const GatherOptions options_;
  TexelMap map_;
  Waves waves_;
  std::vector<DividedTexel> divided_;
  GatherScene scene_;
};

}  // namespace lumel
