// Shadow masks: how much of a lamp each texel sees. A game lights surfaces with the lamp itself and takes only its
// shadow from the map.
#pragma once

#include <cstdint>
#include <vector>

#include "baker/bake/bake.h"
#include "scene/base/expected.h"

namespace lumel {

/// As many lamps fit the channels of one map.
inline constexpr std::size_t kMostShadowMasks = 4;

struct ShadowMaskOptions {
  int samples = 64;  // per texel and lamp
  int rings = 0;     // FinishOptions
  std::uint64_t seed = 1;
};

/// Returns the indices of the lamps with a shadow mask, in the order of their channels R, G, B, A.
std::vector<std::size_t> lightsWithMask(const std::vector<Light>& lights);

/// One RGBA image per page. A channel holds the share of a lamp's irradiance that arrives, 0..1, over the texel and
/// over the lamp, as if it shone alike to all sides: cones, ranges, profiles, colours and modes play no part, so that
/// the map is smooth where these end. 0 where the surface faces away and in channels without a lamp. Texels inside of
/// things (validity under one half in `pages`) take the value of valid ones of their chart, and the maps grow by the
/// rings. Depends on scene, atlas and options alone. Precondition: at most kMostShadowMasks lamps have a mask. Errors:
/// Interrupted.
Expected<std::vector<Image>> bakeShadowMasks(const LitScene& scene, const std::vector<Light>& lights,
                                             const Atlas& atlas, const std::vector<PageTexels>& texels,
                                             const std::vector<BakedPage>& pages, const ShadowMaskOptions& options,
                                             Progress& progress);

}  // namespace lumel
