// Light sources as next-event estimation sees them: punctual lights and emissive triangles.
#pragma once

#include <cstdint>
#include <vector>

#include "baker/distribution.h"
#include "baker/materials.h"
#include "baker/ray_scene.h"
#include "scene/scene.h"

namespace lumel {

/// One light sample as seen from a point, before visibility.
struct LightSample {
  Vec3 wi{0, 0, 1};  // unit, towards the light
  Vec3 weight{0};    // radiance over the density of choosing this direction; for punctual lights irradiance on a facing
                     // surface over the probability of choosing the light. Zero: nothing arrives
  float pdf = 0.0f;  // density per solid angle; 0 for punctual lights, which no ray can hit
  bool distant = false;
  Vec3 target{0};  // end of the shadow ray, already off the light's own surface; unless distant
};

/// Point, spot and directional lights (KHR_lights_punctual).
class PunctualLights {
 public:
  PunctualLights() = default;
  /// Lights that can send nothing are dropped. `extent`: size of the scene, to weigh lights at infinity against others.
  PunctualLights(const std::vector<Light>& lights, float extent);

  bool empty() const { return lights_.empty(); }
  std::size_t size() const { return lights_.size(); }

  /// Density over lights: in proportion to what arrives unshadowed from each above the surface, up to a cosine
  /// ((1 + 2 cosTheta) / 3, so that the tilted basis vectors' weights stay bounded); where there are more than
  /// kLocalLights, in proportion to power.
  LightSample sample(const Vec3& p, const Vec3& n, float u) const;

  /// What light `index` brings, without a choice.
  LightSample sampleOne(std::size_t index, const Vec3& p) const;

  static constexpr std::size_t kLocalLights = 32;

 private:
  std::vector<Light> lights_;
  Distribution byPower_;  // only with more than kLocalLights
};

/// Irradiance that a punctual light brings to a surface at p that faces it: colour * candela / d^2 with the range
/// window and the cone, or colour * lux. `wi` becomes the direction towards it.
Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi);

/// All triangles of casting instances with an emissive material, as one area light.
class EmissiveTriangles {
 public:
  EmissiveTriangles() = default;
  /// Finds them and sets ScenePart::firstEmitter.
  EmissiveTriangles(RayScene& rays, const Materials& materials);

  bool empty() const { return choice_.empty(); }
  std::size_t size() const { return triangles_.size(); }

  /// Density: over triangles by power (mean emitted luminance, integrated roughly over the texture, times area),
  /// uniform by area within. Emission from the front alone unless the material is doubleSided, times opacity.
  LightSample sample(const Vec3& p, float uTriangle, Vec2 uPoint) const;

  /// The density per solid angle with which sample() from `origin` takes the point that a ray hit. Zero for triangles
  /// that are never chosen.
  float pdf(const HitSurface& hit, const Vec3& origin) const;

 private:
  struct Emitter {
    Vec3 corner{0};  // world
    Vec3 e1{0};      // to the other corners
    Vec3 e2{0};
    Vec3 ng{0};                  // unit, front
    float offsetMeters = 0.0f;   // of the ends of shadow rays
    float densityByArea = 0.0f;  // probability of choosing it over its area
    std::uint32_t part = 0;
    std::uint32_t triangle = 0;
    bool doubleSided = false;
    bool uniform = false;  // it sends out `radiance` everywhere
    Vec3 radiance{0};
  };
  /// Fills all but densityByArea from the part and the triangle; returns the area.
  float describe(Emitter& emitter) const;
  Vec3 radianceAt(const Emitter& emitter, Vec2 barycentric) const;

  const RayScene* rays_ = nullptr;
  const Materials* materials_ = nullptr;
  std::vector<Emitter> triangles_;
  Distribution choice_;
};

/// Radiance that leaves a surface found by a ray towards the ray's origin.
Vec3 emittedTowardsRay(const Materials& materials, const HitSurface& hit);

}  // namespace lumel
