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
  Vec3 lift{0};  // added to the start of rays that go below ng (liftToRound); zero: there are none

  Vec3 startTowards(const Vec3& wi) const { return glm::dot(wi, ng) > 0.0f ? rayStart : rayStart + lift; }
  /// Tells whether a ray may leave towards wi, as far as the geometric normal is concerned.
  bool isOpenTowards(const Vec3& wi) const {
    return glm::dot(wi, ng) > 0.0f || (lift != Vec3(0.0f) && glm::dot(wi, ns) > 0.0f);
  }
};

/// Makes a receiver of a texel's point as WavePoints does for the gather: on round things rays that go below the facet
/// start over it (liftToRound).
Receiver receiverAt(const RayScene& rays, const Atlas& atlas, const SurfacePoint& point);

}  // namespace lumel
