// Everything that light meets on its way through a scene, as the integrators see it.
#pragma once

#include "baker/light/emissive_triangles.h"
#include "baker/light/environment_light.h"
#include "baker/light/punctual_lights.h"
#include "baker/rays/materials.h"
#include "baker/rays/ray_scene.h"

namespace lumel {

/// What the scene lacks is empty and costs nothing.
struct LightTransport {
  const RayScene& rays;
  const Materials& materials;
  const PunctualLights& punctual;
  const EmissiveTriangles& emissive;
  const EnvironmentLight& environment;
  /// Those of `punctual` whose light counts where it arrives straight (LightMode::All), and the others; null: it counts
  /// of all of them.
  const PunctualLights* straight = nullptr;
  const PunctualLights* hidden = nullptr;
  /// The emitters that light samples look for; rays find all.
  Emitters sampled = Emitters::All;

  /// The same scene with the lamps whose light texels take straight: `punctual` is for hits.
  LightTransport atTexels() const { return with(straight != nullptr ? *straight : punctual); }
  /// The same scene with other lamps.
  LightTransport with(const PunctualLights& lamps) const {
    return {rays, materials, lamps, emissive, environment, straight, hidden, sampled};
  }
  /// The same scene with other emitters to look for.
  LightTransport with(Emitters emitters) const {
    return {rays, materials, punctual, emissive, environment, straight, hidden, emitters};
  }

  /// Tells whether a ray can bring light back by itself, by what it hits or by leaving the scene.
  /// Returns the density with which light samples from `origin` take a point of an emitter that a ray hit.
  float emitterPdf(const HitSurface& hit, const Vec3& origin) const { return emissive.pdf(hit, origin, sampled); }
  bool raysSeeLight() const { return !emissive.empty() || environment.shines(); }
  bool dark() const { return !raysSeeLight() && punctual.empty(); }
};

}  // namespace lumel
