// One pass of the gather: all waves take the next stretch of their samples, and then the cache is renewed by what they
// found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "baker/gather/gather_state.h"
#include "baker/gather/waves/gather_scene.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

/// Takes the samples of the open pass, [state.samples, state.openEnd), for those of the waves [firstWave, lastWave)
/// that are not done and have not taken them yet. What a wave finds depends on the state at the beginning of the pass
/// alone, so waves may be gathered in any order and in several calls. Errors: Interrupted; the waves that were gathered
/// by then have their samples.
Expected<void> gatherPass(const GatherScene& scene, GatherState& state, std::size_t firstWave, std::size_t lastWave,
                          Progress& progress);

/// Closes the open pass, whose samples all waves have taken: finds what is buried and renews the errors.
void closePass(const GatherScene& scene, GatherState& state);

/// Renews the cache by the light that is known now.
void renewCache(const GatherScene& scene, GatherState& state);

/// Texels more than half of whose rays met backs, and the texels of their charts whose light they pass on instead.
std::vector<TexelMap::Substitute> substitutesFor(const GatherScene& scene, const GatherState& state);

/// Marks texels that lie inside of something by the rays so far: nothing more is gathered for them.
void findBuried(const GatherScene& scene, GatherState& state);

}  // namespace lumel
