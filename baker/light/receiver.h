// Points of texels as receivers of light.
#pragma once

#include "baker/rays/ray_scene.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

/// A point that receives light. Both normals lie on the side that light is gathered on.
struct Receiver {
  Vec3 p{0};
  Vec3 ng{0, 0, 1};
  Vec3 ns{0, 0, 1};
  Vec3 rayStart{0};
};

/// Makes a receiver of a texel's point as WavePoints does for the gather: on round things its rays start over the facet
/// (liftToRound).
Receiver receiverAt(const RayScene& rays, const Atlas& atlas, const SurfacePoint& point);

}  // namespace lumel
