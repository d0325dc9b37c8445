// Light that is passed along the links of the warm-up, one bounce after another.
#pragma once

#include <span>
#include <vector>

#include "baker/gather/gather_state.h"
#include "baker/gather/warm_links.h"
#include "baker/gather/waves/gather_scene.h"

namespace lumel {

/// Solves x = first + relit + A x by its Neumann series: every sweep passes on what the one before it has added, so
/// that a dim room is as exact as a bright one. In the end each sweep adds the same share q of what the one before it
/// did, and the rest of a texel's series is q / (1 - q) of its last term (Aitken 1926): q is the texel's own, since
/// rooms that share no light have series of their own.
///
/// A wave has settled where the limit that its texels' series are seen to have no longer moves, each texel's against
/// its own light. Nothing is judged by the light of the whole scene. Sweeps end where all waves have settled, after a
/// while where nearly all have, and after 64 in any case.
class WarmSweeps {
 public:
  /// `first`: irradiance / pi to begin with; `relit`: what the first sweep finds beside the links' light.
  WarmSweeps(const GatherScene& scene, GatherState& state, const WarmLinks& links, std::vector<Vec3> first,
             std::vector<Vec3> relit);

  /// Sweeps until the light has settled, or as many times as the cache has levels, and fills the cache.
  void run();

  /// After run: irradiance / pi of all texels.
  std::span<const Vec3> light() const { return light_; }

 private:
  void reflect(std::span<const Vec3> light);
  void sweep(bool isFirst);
  float sweepWave(std::size_t wave, bool isFirst);
  float driftOf(std::size_t texel, const Vec3& before, const Vec3& now);
  bool hasSettled(int sweeps) const;
  void addRest();
  void keep(std::size_t level);

  const GatherScene& scene_;
  GatherState& state_;
  const WarmLinks& links_;
  const std::vector<TexelMap::Substitute> substitutes_;
  std::vector<Vec3> light_;      // of all sweeps
  std::vector<Vec3> added_;      // by the last one
  std::vector<float> ratio_;     // of that to what the one before it added
  std::vector<Vec3> reflected_;  // of what was added: links look up one product instead of two values
  std::vector<float> drift_;     // per wave: by how much limits still move, relative to the light
};

}  // namespace lumel
