// The lobes around which visibility is gathered, and their integrals over one azimuth slice in closed form.
// Derivation in ssbump/occlusion/README.md.
#pragma once

#include <span>
#include <vector>

#include "scene/base/math.h"

namespace lumel::ssbump {

enum class LobeShape {
  Hemisphere,  // every direction above the base surface (Green 2007)
  Cone,        // of those, the ones within half the opening angle of the axis
};

/// One occlusion channel: visibility weighted by max(0, w.axis) over the lobe's directions above the base surface.
/// The axis is a unit vector in tangent space (t, b, n).
struct Lobe {
  Vec3 axis{0, 0, 1};
  LobeShape shape = LobeShape::Hemisphere;
  float coneOpeningDegrees = 120.0f;  // total; Cone only
};

/// The three lobes of the RNM basis, in its order.
std::vector<Lobe> rnmLobes(LobeShape shape = LobeShape::Hemisphere, float coneOpeningDegrees = 120.0f);

/// Cosine-weighted ambient occlusion.
inline Lobe ambientLobe() { return {}; }

/// The weight of direction w (unit, tangent space) in the lobe: max(0, w.axis), or 0 outside the cone or below the
/// base.
float lobeWeight(const Lobe& lobe, const Vec3& w);

/// The lobe's integral over the azimuth slice phi, above a horizon of slope t >= 0:
///   F(t) = Integral over elevations e in [lo, hi], tan e > t, of max(0, a cos e + c sin e) cos e de
/// with a = axis.x cos phi + axis.y sin phi and c = axis.z. For t in [tLo, tHi] it is
///   F(t) = top - (a (atan t + t q) + c t^2 q) / 2, q = 1 / (1 + t^2);
/// below tLo it is F(tLo) = open, above tHi it is 0.
struct LobeSlice {
  float a = 0, c = 0;
  float tLo = 0, tHi = 0;
  float top = 0, open = 0;

  LobeSlice(const Lobe& lobe, double phi);
  double above(double t) const;
};

/// Azimuth j of count: 2 pi (j + 1/4) / count. Slices at 1/4, 3/4, 5/4, ... of their spacing from an axis on one side
/// lie at 3/4, 7/4, ... on the other: what is alike on both sides of an axis, as joints and walls are, is looked at
/// twice as finely as with (j + 1/2). With a multiple of 4 no slice lies on an axis or a diagonal of the map.
inline double sliceAzimuth(int j, int count) { return 2 * std::numbers::pi * (j + 0.25) / count; }

}  // namespace lumel::ssbump
