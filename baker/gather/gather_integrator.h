// Progressive final gather: texels gather the light that other texels are already known to reflect, instead of
// following every path to its end (Ward and Heckbert 1992, "Irradiance Gradients", keep such a cache at points chosen
// on the way; here the lightmap's texels are the points). Method, bias and figures: baker/README.md.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baker/gather/doubling_error.h"
#include "baker/gather/gather_wave.h"
#include "baker/gather/warm_links.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

struct GatherOptions {
  int samples = 1;     // per texel; with a time budget the most, with a target error the least
  int maxSamples = 1;  // with a target error: the most
  int bounces = -1;    // indirect bounces; negative: all that matter
  bool indirectOnly = false;
  std::uint64_t seed = 1;
  float targetError = 0.0f;        // relative standard error at which a wave of texels is done; 0: none
  bool adaptive = false;           // without a target: a wave is done where more samples would not be seen
  double timeBudgetSeconds = 0.0;  // no pass is begun that would probably end later; 0: none
};

/// Share of the texels at which the target error must be met for the bake to end.
inline constexpr double kTargetShare = 0.95;
/// The error of texels darker than this share of the mean is judged as if they were so bright.
inline constexpr double kDarkFloor = 0.1;

/// What is stored of a texel beside its light.
struct BakedTexel {
  float coverage = 0.0f;
  float validity = 1.0f;
  float standardError = 0.0f;
  std::uint32_t samples = 0;
  bool probed = false;
  std::array<Vec3, kProbeNormals> probes{};  // light on probeNormals(), where probed
};

/// Light of all texels, numbered through as in TexelMap: a vector for each map, so that each can be freed once its
/// image is made.
struct TexelLight {
  std::vector<Vec3> flat;
  std::array<std::vector<Vec3>, 3> rnm;

  void resize(std::size_t count);
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
/// Errors: DoublingError, for the flat map; those of the worst map follow by how much farther it moved around the wave.
/// A wave of texels is done when each of its texels' worst map is as good as its goal: the target, or an error that
/// nobody sees beside that of others. By the target, texels inside of something (validity under one half) are not
/// judged.
class GatherIntegrator {
 public:
  /// Samples of the first pass; once they are doubled errors are known.
  static constexpr std::uint32_t kFirstPass = 8;

  /// Keeps references to its arguments.
  GatherIntegrator(const LightTransport& transport, const RnmKernels& kernels, const Atlas& atlas,
                   const std::vector<PageTexels>& texels, const GatherOptions& options);

  /// Errors: Interrupted.
  Expected<void> run(Progress& progress);

  /// After run; once.
  TexelLight takeLight();
  /// After run. `probes` are means.
  BakedTexel texel(std::uint32_t page, std::size_t index) const;
  std::size_t firstOfPage(std::size_t page) const { return map_.firstOfPage(page); }

  std::uint64_t rays() const { return rays_; }
  std::uint64_t shadowRays() const { return shadowRays_; }
  const std::vector<NonFiniteSample>& nonFinite() const { return nonFinite_; }

 private:
  struct Wave {
    std::uint32_t page = 0;
    std::uint32_t first = 0;  // texel of the page
    std::uint32_t count = 0;
    bool done = false;  // as good as its goal
    // For the flat map and the others: sum over texels of the square of how far their means moved in the last pass.
    std::array<float, 4> moved{};
  };
  Expected<void> warmUp(Progress& progress);
  /// `light`: irradiance / pi to begin with; `constant`: what every sweep finds again, links apart.
  /// Returns what texels reflect in the end.
  std::vector<PackedColor> solveLinks(const WarmLinks& links, std::vector<Vec3> light, std::span<const Vec3> constant);
  void makeCache();
  void makeSums();
  void dropCache();
  Expected<void> pass(std::uint32_t first, std::uint32_t end, Progress& progress);
  void store(std::size_t wave, const GatheredWave& done, std::uint32_t first, std::uint32_t end);
  void renewCache();
  void substituteInvalid();
  /// Tells by the rays so far which texels lie inside of something.
  void findBuried();
  /// Samples of a texel that count: those from points in the open.
  float weightOf(std::size_t texel) const;
  /// Irradiance / pi of the maps.
  Vec3 meanLight(std::size_t texel) const { return sums_.flat[texel] / weightOf(texel); }
  /// `share` of the mean over all texels; 0 before there are samples.
  double darkFloor(double share) const;
  float errorOf(std::size_t wave, std::size_t i) const;
  /// Irradiance / pi as of level `level`, from all samples so far.
  Vec3 lightOf(std::size_t texel, std::size_t level) const;
  std::size_t probeOf(std::uint32_t page, std::size_t index) const {
    return firstProbe_[page] + index / kProbeStride;
  }
  void estimateErrors();
  /// Error of the worst map by that of the flat one, around a wave.
  double worstByFlat(std::size_t wave) const;
  /// Marks waves that are as good as their goal. Returns the share of texels that are.
  double markDone();
  template <class Body>
  Expected<void> forEachWave(Progress& progress, Body body);
  std::span<LightSpread> spreadsOf(std::size_t wave);
  std::size_t stored() const { return static_cast<std::size_t>(scene_.levels.count); }

  const GatherOptions options_;
  TexelMap map_;
  GatherScene scene_;
  std::vector<Wave> waves_;
  std::vector<LightSpread> spreads_;    // strategies and gather rays of every wave
  std::vector<std::size_t> firstWave_;  // per page
  TexelLight sums_;                     // over all samples so far
  std::vector<Vec3> levelSums_;         // levels.count per texel, unless endless
  std::vector<PackedColor> reflectance_;
  // Of the cache alone, with indirectOnly: light from light samples; sums of what the rays of all passes saw shine.
  std::vector<Vec3> direct_;
  std::vector<Vec3> seen_;
  std::vector<PackedColor> cache_;  // levels.count per texel
  std::vector<float> coverage_;
  std::vector<std::uint32_t> backFaces_;  // rays that met backs
  std::vector<std::uint8_t> buried_;      // nothing more is gathered for them
  std::vector<std::uint8_t> warmBacks_;  // bits of the warm-up's rays, until the first pass is done
  std::vector<InsideTally> inside_;
  std::vector<std::array<Vec3, kProbeNormals>> probes_;
  std::vector<std::size_t> firstProbe_;  // per page
  std::size_t probeCount_ = 0;
  std::vector<std::uint32_t> samplesOf_;
  std::optional<DoublingError> errors_;
  std::vector<TexelMap::Substitute> substitutes_;
  std::uint64_t rays_ = 0;
  std::uint64_t shadowRays_ = 0;
  std::vector<NonFiniteSample> nonFinite_;
};

}  // namespace lumel
