// A bake by the gather that can be stopped and gone on with, and whose surfaces can be asked for light afterwards.
#pragma once

#include <cstdint>
#include <optional>

#include "baker/gather/gather_integrator.h"

namespace lumel {

/// What a caller of bake() shares with the gather.
struct GatherSession {
  /// In: a state to go on from, if there is one; readState of it needs sessionKey(). Out: where a gather that was
  /// interrupted stands; empty after one that has ended.
  std::optional<GatherState> state;
  GatherPauses pauses;
  /// In: whether `surfaces` is wanted; it takes 16 bytes per covered texel and the map from pages to texels.
  bool keepsSurfaces = false;
  /// Out: refers to the lit scene, the atlas and the texels of the bake.
  std::optional<SurfaceCache> surfaces;
};

}  // namespace lumel
