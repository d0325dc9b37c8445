#include "ssbump/occlusion/lobe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lightmap/maps/rnm_basis.h"

namespace lumel::ssbump {
namespace {

constexpr double kHalfPi = std::numbers::pi / 2;

double primitive(double a, double c, double t) {
  if (!std::isfinite(t) || t > 1e150) return (a * kHalfPi + c) / 2;
  const double q = 1 / (1 + t * t);
  return (a * (std::atan(t) + t * q) + c * t * t * q) / 2;
}

double slopeOf(double elevation) {
  if (elevation <= 0) return 0;
  return elevation >= kHalfPi ? std::numeric_limits<double>::infinity() : std::tan(elevation);
}

}  // namespace

std::vector<Lobe> rnmLobes(LobeShape shape, float coneOpeningDegrees) {
  std::vector<Lobe> lobes;
  for (const Vec3& axis : kRnmBasis) lobes.push_back({axis, shape, coneOpeningDegrees});
  return lobes;
}

float lobeWeight(const Lobe& lobe, const Vec3& w) {
  const float cosine = glm::dot(lobe.axis, w);
  if (w.z < 0 || cosine <= 0) return 0;
  if (lobe.shape == LobeShape::Cone && cosine < std::cos(lobe.coneOpeningDegrees * kPi / 360)) return 0;
  return cosine;
}

LobeSlice::LobeSlice(const Lobe& lobe, double phi) {
  const double ad = lobe.axis.x * std::cos(phi) + lobe.axis.y * std::sin(phi);
  const double cd = lobe.axis.z;
  a = static_cast<float>(ad);
  c = static_cast<float>(cd);
  // a cos e + c sin e = r cos(e - e0): the lobe covers the elevations within `half` of e0.
  const double r = std::hypot(ad, cd);
  const double least =
      lobe.shape == LobeShape::Cone ? std::max(0.0, std::cos(lobe.coneOpeningDegrees * std::numbers::pi / 360)) : 0.0;
  if (r <= least || r < 1e-12) return;  // the slice misses the lobe: F = 0
  const double e0 = std::atan2(cd, ad);
  const double half = std::acos(least / r);
  const double lo = std::clamp(e0 - half, 0.0, kHalfPi);
  const double hi = std::clamp(e0 + half, 0.0, kHalfPi);
  if (hi <= lo) return;
  tLo = static_cast<float>(slopeOf(lo));
  // An open upper end is beyond any slope that a height map can hold.
  tHi = hi >= kHalfPi ? std::numeric_limits<float>::max() : static_cast<float>(slopeOf(hi));
  const double upper = primitive(ad, cd, hi >= kHalfPi ? std::numeric_limits<double>::infinity() : slopeOf(hi));
  top = static_cast<float>(upper);
  open = static_cast<float>(upper - primitive(ad, cd, slopeOf(lo)));
}

double LobeSlice::above(double t) const {
  if (t <= static_cast<double>(tLo)) return open;
  if (t >= static_cast<double>(tHi)) return 0;
  return top - primitive(a, c, t);
}

}  // namespace lumel::ssbump
