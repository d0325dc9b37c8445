// When a gather ends: a wave of texels is done when each of its texels' worst map is as good as its goal: the target,
// or an error that nobody sees beside that of others.
#pragma once

#include <cstdint>

#include "baker/gather/gather_state.h"
#include "baker/gather/waves/gather_scene.h"

namespace lumel {

/// Share of the texels of a wave and those around it at which the target error must be met.
inline constexpr double kTargetShare = 0.95;
/// The error of texels darker than this share of their place's light is judged as if they were so bright.
inline constexpr double kDarkFloor = 0.1;
/// Fewest samples after which an error estimate may end the work on a texel: two doublings.
inline constexpr std::uint32_t kFirstJudged = 32;

/// Marks waves that are as good as their goal. By the target, texels inside of something (validity under one half) are
/// not judged; those whose place is not known never are. Returns whether all waves are done.
bool markDone(const GatherScene& scene, const GatherOptions& options, GatherState& state);

}  // namespace lumel
