// Lamps that are more than a point: spheres, panels, suns that fill a part of the sky, and lamps with a profile. Rays
// do not see them, so each is sampled alone, without weights against hits.
#pragma once

#include <memory>

#include "baker/light/light_tree.h"
#include "scene/scene.h"

namespace lumel {

class LightShape {
 public:
  explicit LightShape(const Light& light);

  /// Tells whether a light is one of these: else PunctualLights samples it itself.
  static bool isOne(const Light& light);

  struct Sample {
    Vec3 wi{0};      // unit, towards the point on the lamp
    Vec3 weight{0};  // radiance over density; zero: nothing arrives
    Vec3 target{0};  // the point; unused for suns
  };
  /// Samples what the point p sees of the lamp. Density per solid angle:
  /// - spheres: 1 / (2 pi (1 - cos s)) in the cone that they fill, sin s = r / d. From inside a sphere its shell shines
  ///   from all around, with density 1 / (4 pi): the light is continuous where a surface cuts a soft lamp;
  /// - rectangles: one over their solid angle (Urena, Fajardo and King 2013), by area below kFewSteradians;
  /// - discs: by area from afar (Shirley and Chiu 1997), within a radius as the square about them, whose corners bring
  ///   nothing;
  /// - suns: cos a / (pi sin^2 s), a being the angle off the middle, so that the weight is E / cos a.
  /// Where 1 / d^2 has no bound, the weight is at most radiance times 4 pi.
  Sample sample(const Vec3& p, const Vec2& u) const;

  /// Estimates what the lamp brings unshadowed, times (1 + 2 cosTheta), by the sphere about it: never zero where it
  /// brings anything. A normal of zero leaves the side open.
  float importance(const Vec3& p, const Vec3& n) const;

  /// Bounds a lamp with a place.
  LightBounds bounds() const;
  /// Radius of the sphere about the lamp that importance takes it for, in metres.
  float boundRadius() const { return boundRadius_; }
  const Vec3& position() const { return light_.position; }

  /// Rectangles are sampled by area where they fill less.
  static constexpr double kFewSteradians = 1e-3;

 private:
  Sample sampleSphere(const Vec3& p, const Vec2& u) const;
  Sample sampleRectangle(const Vec3& p, const Vec2& u, const Vec2& size) const;
  Sample sampleDisc(const Vec3& p, const Vec2& u) const;
  Sample sampleSun(const Vec2& u) const;
  /// The sample of the panel's point x, by `perDensity`: one over the density per area, or per solid angle.
  Sample towardsPanel(const Vec3& p, const Vec3& x, double perDensity, bool byArea) const;
  /// What spots, ranges and profiles leave of the light of a lamp with a place: by the direction from it, -wi, and the
  /// distance of its centre.
  float factor(const Vec3& wi, float distance2) const;

  Light light_;
  Vec3 power_{0};  // colour times intensity
  float boundRadius_ = 0.0f;
  float onAxis_ = 0.0f;  // luminance of the greatest intensity (candela; of suns lux)
  float cosOuter_ = -2.0f, perCone_ = 1.0f;
  float perRange2_ = 0.0f;
};

}  // namespace lumel
