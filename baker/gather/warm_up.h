// The start of the cache, before the first pass.
#pragma once

#include "baker/gather/gather_state.h"
#include "baker/gather/waves/gather_scene.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

/// Finds the texels that lie in several places, in their order. Errors: Interrupted.
Expected<std::vector<DividedTexel>> findDivided(const GatherScene& scene, Progress& progress);

/// Fills the cache of a gather that has not begun: light samples and kWarmRays rays of every texel are taken once, and
/// the light of one bounce after another is passed along these rays without tracing more. Errors: Interrupted; the
/// state is then of no use.
Expected<void> warmUp(const GatherScene& scene, GatherState& state, Progress& progress);

}  // namespace lumel
