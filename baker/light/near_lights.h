// Lights with a place that lie close to a texel. Points that are spread evenly over the texel hardly ever meet the spot
// under such a light, which holds most of its irradiance: sampled so, its light is missing but for rare fireflies.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/light_transport.h"
#include "baker/light/receiver.h"
#include "baker/rays/sampling.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

/// Within its reach R of a receiver a light of irradiance E is taken as two: E d^2 / R^2, which is bounded and sampled
/// like all others at points of the texel, and the rest, E (1 - d^2 / R^2), sampled by the solid angle that the texel
/// fills as the light sees it, which takes the peak of 1 / d^2 away:
/// A light that is more than a point counts so where its centre lies above the texel and it is small against R.
///     1/|A| Integral_A E (1 - d^2 / R^2) K / cosTheta dA = 1/|A| Integral I (1 - d^2 / R^2) K / cosTheta dw
/// K being a map's kernel and I the intensity towards the point. Both parts are smooth, so nothing depends on luck.
class NearLight {
 public:
  /// A sample of the second part.
  struct Sample {
    std::size_t piece = 0;      // of the footprint
    Vec2 barycentric{0};        // of the piece's triangle (TexelFootprint::at)
    float perIntensity = 0.0f;  // light by addition to a map: this times intensity times the kernel over pi
  };

  /// `light` is an index into PunctualLights, at `position`.
  NearLight(std::size_t light, const Vec3& position, float reach, const TexelFootprint& footprint);

  std::size_t light() const { return light_; }
  /// Tells whether the light sees any part of the texel from the front.
  bool sees() const { return !fans_.empty(); }
  /// Precondition: sees(). Density: uniform by solid angle as the light sees the texel, weighed by how densely texels
  /// lie on each triangle.
  Sample sample(Vec2 u) const;

 private:
  /// A spherical triangle whose pole is the foot of the light on the triangle's plane, or a corner.
  struct Fan {
    SphericalTriangle seen{};
    double solidAngle = 0.0;
    double before = 0.0;  // sum of weight * solidAngle of those before
    double weight = 0.0;  // texels per square metre, over those that are covered
    Vec3d normal{0};      // of the plane, towards the light
    double height = 0.0;  // of the light above it
    Vec3d corner{0};      // of the piece's triangle, from the light
    Vec3d e1{0}, e2{0};
    std::array<Vec2, 3> barycentric{};
    std::size_t piece = 0;
  };
  void addTriangle(const TexelFootprint& footprint, std::size_t piece, const std::array<Vec2, 3>& barycentric,
                   double texels);

  std::size_t light_;
  Vec3d position_;
  double perReach2_;
  std::vector<Fan> fans_;
  double total_ = 0.0;
};

/// The lights near a texel, and one over the square of its reach R, for ReceiverLanes: twice the diameter of its
/// covered part. Further away 1 / d^2 changes little enough over the texel for points that are spread evenly.
struct NearLights {
  std::vector<NearLight> lights;
  float perReach2 = 0.0f;  // 0: no light is near
};
NearLights nearLightsOf(const PunctualLights& lights, const TexelFootprint& footprint);
/// Tells whether any light is within reach of a texel whose covered part has these bounds.
bool isAnyLightNear(const PunctualLights& lights, const Vec3& least, const Vec3& most);

/// Light that a sample of a near light brings, before visibility.
struct NearSample {
  Receiver receiver;
  Frame frame;
  Vec3 wi{0};      // unit, towards the light
  Vec3 target{0};  // end of the shadow ray
  Vec3 light{0};   // radiance over density
};
/// Takes a sample of `near`: u chooses the point of the texel, `onLight` the one of a light that is more than a point.
/// Its light is zero where none could arrive.
NearSample sampleNear(const LightTransport& transport, const Atlas& atlas, const TexelFootprint& footprint,
                      const NearLight& near, Vec2 u, Vec2 onLight);

}  // namespace lumel
