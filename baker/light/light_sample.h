// What light sampling takes and gives: receivers of a wave, and one light sample for each.
#pragma once

#include "baker/rays/lanes.h"

namespace lumel {

/// The points of a wave that receive light, a view. Both normals lie on the side that light is gathered on.
struct ReceiverLanes {
  const LaneFlags& active;
  const Vec3Lanes& p;
  const Vec3Lanes& ng;
  const Vec3Lanes& ns;
  const Vec3Lanes& rayStart;
  bool open = false;  // points in space: light arrives from all sides, and both normals are zero
  /// Null, or by lane one over the square of the reach within which lights are taken as two (NearLight), 0 for none.
  const float* perReach2 = nullptr;
  const Vec3Lanes* lift = nullptr;  // as of Receiver; null: of zeros
};

/// One light sample of every lane as seen from its receiver, before visibility.
struct alignas(64) LightSampleLanes {
  Vec3Lanes wi;         // unit, towards the light
  Vec3Lanes weight;     // radiance over the density of this direction; for punctual lights irradiance on a facing
                        // surface over the probability of choosing the light. Zero: nothing arrives
  Vec3Lanes target;     // end of the shadow ray, already off the light's own surface; unless distant
  float pdf[kLanes];    // density per solid angle; 0 for punctual lights, which no ray can hit
  int distant[kLanes];  // 1: the light is infinitely far away
};

}  // namespace lumel
