// Samplers over hemispheres and triangles. Every sampler states its density, and has its pdf and its inverse
// (which maps a result back to the u that made it) for round-trip tests. Directions are in the local frame of the
// normal: z is the cosine.
#pragma once

#include <algorithm>

#include "scene/math.h"

namespace lumel {

/// Cosine and sine of a share of a full turn in [0, 1], to 1e-7: without a call and without branches, so that loops
/// over lanes become vector code with the same bits on every processor.
inline Vec2 onUnitCircle(float turn) {
  // The angle from the nearest quarter is at most pi/4, where Taylor's series to the 9th order do.
  const int quarter = static_cast<int>(4.0f * turn + 0.5f);
  const float a = (4.0f * turn - static_cast<float>(quarter)) * (0.5f * kPi);
  const float a2 = a * a;
  const float s = a * (1.0f + a2 * (-1.0f / 6 + a2 * (1.0f / 120 + a2 * (-1.0f / 5040 + a2 * (1.0f / 362880)))));
  const float c = 1.0f + a2 * (-0.5f + a2 * (1.0f / 24 + a2 * (-1.0f / 720 + a2 * (1.0f / 40320))));
  const float x = (quarter & 1) != 0 ? s : c;
  const float y = (quarter & 1) != 0 ? c : s;
  return {((quarter + 1) & 2) != 0 ? -x : x, (quarter & 2) != 0 ? -y : y};
}

inline Vec3 directionFromZ(float z, float turn) {
  const float r2 = (1.0f - z) * (1.0f + z);
  const float r = std::sqrt(r2 > 0.0f ? r2 : 0.0f);
  const Vec2 around = onUnitCircle(turn);
  return {r * around.x, r * around.y, z};
}

/// Azimuth of a direction as a share of a full turn, in [0, 1).
inline float turnOf(const Vec3& w) {
  const float turn = std::atan2(w.y, w.x) * (0.5f * kInvPi);
  return turn < 0 ? turn + 1.0f : turn;
}

/// Density: cosTheta / pi.
inline Vec3 sampleCosineHemisphere(Vec2 u) { return directionFromZ(std::sqrt(1.0f - u.x), u.y); }
inline float cosineHemispherePdf(float cosTheta) { return cosTheta > 0 ? cosTheta * kInvPi : 0.0f; }
inline Vec2 invertCosineHemisphere(const Vec3& w) { return {1.0f - w.z * w.z, turnOf(w)}; }

/// Density: (1 + 2 cosTheta) / 4pi, the mixture of half cosine and half uniform hemisphere.
/// Its distribution of z = cosTheta has the cumulative (z^2 + z) / 2, which is inverted in closed form, so that the
/// two halves need no choice between them and stratified u stay stratified. The kernel weights are bounded:
/// max(0, w.n) / (pi pdf) <= 4/3 and max(0, w.B_i) / (pi pdf) <= 4 sqrt(2/3).
inline Vec3 sampleGatherHemisphere(Vec2 u) {
  // Of the two roots, written without cancellation; u.x is turned round so that small values are near the normal.
  const float c = 1.0f - u.x;
  const float z = 4.0f * c / (1.0f + std::sqrt(1.0f + 8.0f * c));
  return directionFromZ(z < 1.0f ? z : 1.0f, u.y);
}
inline float gatherHemispherePdf(float cosTheta) {
  return cosTheta > 0 ? (1.0f + 2.0f * cosTheta) * (0.25f * kInvPi) : 0.0f;
}
inline Vec2 invertGatherHemisphere(const Vec3& w) { return {1.0f - 0.5f * (w.z * w.z + w.z), turnOf(w)}; }

/// Density: 1 / area. Returns the weights of vertices 1 and 2 (Pharr et al., square-root map).
inline Vec2 sampleTriangle(Vec2 u) {
  const float root = std::sqrt(u.x);
  return {root * (1.0f - u.y), root * u.y};
}
inline Vec2 invertTriangle(Vec2 barycentric) {
  const float root = barycentric.x + barycentric.y;
  return {root * root, root > 0 ? barycentric.y / root : 0.0f};
}

/// Weight of a sample taken with density `pdf` where another technique would take it with `other` (Veach 1997, the
/// power heuristic with exponent 2, one sample of each). An `other` of zero gives 1, an infinite one 0.
inline float misWeight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace lumel
