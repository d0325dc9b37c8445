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

/// tan(solidAngle / 2) of a triangle seen from the origin as volume / below, for corners in any order (Van Oosterom and
/// Strackee 1983). volume = |dot(a, cross(b - a, c - a))|; taken from the edges it is accurate for small triangles.
template <class V, class T>
T belowSolidAngle(const V& a, const V& b, const V& c) {
  const T la = glm::length(a);
  const T lb = glm::length(b);
  const T lc = glm::length(c);
  return la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
}

/// 0 where the origin lies in the triangle's plane.
template <class V, class T>
T triangleSolidAngle(const V& a, const V& b, const V& c, T volume) {
  return volume > T(0) ? T(2) * std::atan2(volume, belowSolidAngle<V, T>(a, b, c)) : T(0);
}

/// A triangle on the unit sphere, its corners unit vectors. Density: 1 / solidAngle (Arvo 1995, "Stratified Sampling of
/// Spherical Triangles"). Precondition: not degenerate.
struct SphericalTriangle {
  Vec3d a, b, c;

  double solidAngle() const { return triangleSolidAngle(a, b, c, std::abs(glm::dot(a, glm::cross(b, c)))); }

  /// u.x chooses the part cut off by an arc from b to the opposite edge, u.y the place on that arc.
  /// `angle`: solidAngle(), which the caller has.
  Vec3d sample(Vec2 u, double angle) const {
    const Vec3d ab = glm::cross(a, b);
    const Vec3d ac = glm::cross(a, c);
    const double scale = 1.0 / std::sqrt(glm::dot(ab, ab) * glm::dot(ac, ac));
    const double cosAlpha = glm::dot(ab, ac) * scale;
    // Not from the cosine, which is blind where the angle is small. (cross(ab, ac) = a * volume.)
    const double sinAlpha = std::abs(glm::dot(a, glm::cross(b, c))) * scale;
    const double part = static_cast<double>(u.x) * angle;
    const double sinPart = std::sin(part);
    const double cosPart = std::cos(part);
    const double s = sinPart * cosAlpha - cosPart * sinAlpha;  // of part - alpha
    const double t = cosPart * cosAlpha + sinPart * sinAlpha;
    const double across = t - cosAlpha;
    const double along = s + sinAlpha * glm::dot(a, b);
    const double below = (along * s + across * t) * sinAlpha;
    const double q = std::clamp(((along * t - across * s) * cosAlpha - along) / below, -1.0, 1.0);
    const Vec3d end = below != 0.0 ? arcPoint(a, c, q) : a;
    const double z = 1.0 - static_cast<double>(u.y) * (1.0 - glm::dot(end, b));
    return arcPoint(b, end, z);
  }
  Vec2 invert(const Vec3d& w) const {
    Vec3d end = glm::cross(glm::cross(b, w), glm::cross(c, a));
    if (!(glm::dot(end, end) > 0.0)) return {0.0f, 0.0f};  // at b
    end = glm::normalize(glm::dot(end, a + c) < 0.0 ? -end : end);
    const double part = SphericalTriangle{a, b, end}.solidAngle() / solidAngle();
    const Vec3d toW = w - b;
    const Vec3d toEnd = end - b;
    return {static_cast<float>(part), static_cast<float>(glm::dot(toW, toW) / glm::dot(toEnd, toEnd))};
  }

 private:
  /// The point at cosine z from `from` on the arc towards `to`.
  static Vec3d arcPoint(const Vec3d& from, const Vec3d& to, double z) {
    const Vec3d side = to - from * glm::dot(from, to);
    const double length = glm::length(side);
    if (!(length > 0.0)) return from;
    return from * z + side * (std::sqrt(std::max(0.0, (1.0 - z) * (1.0 + z))) / length);
  }
};

/// Weight of a sample taken with density `pdf` where another technique would take it with `other` (Veach 1997, the
/// power heuristic with exponent 2, one sample of each). An `other` of zero gives 1, an infinite one 0.
inline float misWeight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace lumel
