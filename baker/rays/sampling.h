// Samplers over hemispheres and triangles. Every sampler states its density, and has its pdf and its inverse
// (which maps a result back to the u that made it) for round-trip tests. Directions are in the local frame of the
// normal: z is the cosine.
#pragma once

#include <algorithm>

#include "baker/rays/lanes.h"
#include "scene/base/math.h"

namespace lumel {

/// Returns cosine and sine of a share of a full turn in [0, 1], to 1e-7: without a call and without branches, so that
/// loops over lanes become vector code with the same bits on every processor.
inline Vec2 onUnitCircle(float turn) {
  // The angle from the nearest quarter is at most pi/4, where Taylor's series to the 9th order do.
  const int quarter = static_cast<int>(4.0f * turn + 0.5f);
  const float a = (4.0f * turn - static_cast<float>(quarter)) * (0.5f * kPi);
  const float a2 = a * a;
  const float s = a * (1.0f + a2 * (-1.0f / 6 + a2 * (1.0f / 120 + a2 * (-1.0f / 5040 + a2 * (1.0f / 362880)))));
  const float c = 1.0f + a2 * (-0.5f + a2 * (1.0f / 24 + a2 * (-1.0f / 720 + a2 * (1.0f / 40320))));
  const float x = pick((quarter & 1) != 0, s, c);
  const float y = pick((quarter & 1) != 0, c, s);
  return {pick(((quarter + 1) & 2) != 0, -x, x), pick((quarter & 2) != 0, -y, y)};
}

inline Vec3 directionFromZ(float z, float turn) {
  const float r2 = (1.0f - z) * (1.0f + z);
  const float r = std::sqrt(r2 > 0.0f ? r2 : 0.0f);
  const Vec2 around = onUnitCircle(turn);
  return {r * around.x, r * around.y, z};
}

/// Returns the azimuth of a direction as a share of a full turn, in [0, 1).
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

/// Returns the angle of (x, y) for y >= 0, in [0, pi], to 2e-7, without a call and without branches. (0, 0) gives 0.
[[gnu::always_inline]] inline float angleAbove(float y, float x) {
  const float steep = std::abs(x);
  const float most = pick(steep >= y, steep, y);
  const float ratio = pick(steep >= y, y, steep) / pick(most > 0.0f, most, 1.0f);
  // From pi/8 on turned back by pi/4, so that the series is short.
  const bool isFar = ratio > 0.41421356f;
  const float t = pick(isFar, (ratio - 1.0f) / (ratio + 1.0f), ratio);
  const float t2 = t * t;
  const float series = t + t * t2 * (-0.33333288f + t2 * (0.19991394f + t2 * (-0.1402655f + t2 * 0.08529791f)));
  const float near = pick(isFar, 0.25f * kPi + series, series);
  const float acute = pick(steep >= y, near, 0.5f * kPi - near);
  return pick(x < 0.0f, kPi - acute, acute);
}
inline double angleAbove(double y, double x) { return std::atan2(y, x); }

/// Returns `below` of tan(solidAngle / 2) = volume / below for a triangle seen from the origin, corners in any order
/// (Van Oosterom and Strackee 1983). volume = |dot(a, cross(b - a, c - a))|; taken from the edges it is accurate for
/// small triangles.
template <class V, class T>
[[gnu::always_inline]] inline T belowSolidAngle(const V& a, const V& b, const V& c) {
  const T la = glm::length(a);
  const T lb = glm::length(b);
  const T lc = glm::length(c);
  return la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
}

/// Returns the solid angle of a triangle seen from the origin, or 0 where the origin lies in the triangle's plane.
template <class V, class T>
[[gnu::always_inline]] inline T triangleSolidAngle(const V& a, const V& b, const V& c, T volume) {
  const T angle = T(2) * angleAbove(volume > T(0) ? volume : T(0), belowSolidAngle<V, T>(a, b, c));
  return volume > T(0) ? angle : T(0);
}

/// A triangle on the unit sphere, its corners unit vectors. Density: 1 / solidAngle (Arvo 1995, "Stratified Sampling of
/// Spherical Triangles"). Precondition: not degenerate.
template <class T>
struct SphericalTriangleOf {
  using V = glm::vec<3, T>;
  V a, b, c;

  T volume() const { return std::abs(glm::dot(a, glm::cross(b, c))); }
  T solidAngle() const { return triangleSolidAngle(a, b, c, volume()); }

  /// u.x chooses the part cut off by an arc from b to the opposite edge, u.y the place on that arc.
  /// `angle` is solidAngle() and `volumeOfCorners` is volume(), which a caller may know better.
  [[gnu::always_inline]] V sample(Vec2 u, T angle, T volumeOfCorners) const {
    // The part is (a, b, end) with end on the arc from a to c. By the formula above its solid angle is `part` where
    // dot(end + a, g) = 0 with g = sin(part/2) (a + b) - cos(part/2) cross(a, b); so half way from a to end lies
    // c dot(a, g) - a dot(c, g), and end is a mirrored there. Nothing cancels where the triangle is small.
    const Vec2 turned = onUnitCircle(u.x * static_cast<float>(angle) * (0.25f * kInvPi));
    const T cosine = turned.x, sine = turned.y;
    const T alongA = sine * (T(1) + glm::dot(a, b));
    const T alongC = sine * (glm::dot(a, c) + glm::dot(b, c)) - cosine * volumeOfCorners;
    const V half = c * alongA - a * alongC;
    const T half2 = glm::dot(half, half);
    const T turn = T(2) * glm::dot(a, half) / (half2 > T(0) ? half2 : T(1));
    const V end = half * turn - a * (half2 > T(0) ? T(1) : T(-1));
    const V chord = end - b;
    const T fromOne = static_cast<T>(u.y) * (T(0.5) * glm::dot(chord, chord));  // 1 - the cosine of the place
    const V side = chord - b * glm::dot(b, chord);
    const T side2 = glm::dot(side, side);
    const T reach = std::sqrt(fromOne * (T(2) - fromOne) / (side2 > T(0) ? side2 : T(1)));
    return b * (T(1) - fromOne) + side * reach;
  }
  Vec2 invert(const V& w) const {
    V end = glm::cross(glm::cross(b, w), glm::cross(c, a));
    if (!(glm::dot(end, end) > T(0))) return {0.0f, 0.0f};  // at b
    end = glm::normalize(glm::dot(end, a + c) < T(0) ? -end : end);
    const T part = SphericalTriangleOf{a, b, end}.solidAngle() / solidAngle();
    const V toW = w - b;
    const V toEnd = end - b;
    return {static_cast<float>(part), static_cast<float>(glm::dot(toW, toW) / glm::dot(toEnd, toEnd))};
  }
};
using SphericalTriangle = SphericalTriangleOf<double>;

/// The density with which a surface gathers from a direction above it: constant + perCosine * cosTheta.
struct SurfaceDensity {
  float constant = 0.0f;
  float perCosine = 0.0f;
  float operator()(float cosTheta) const { return cosTheta > 0.0f ? constant + perCosine * cosTheta : 0.0f; }
};
/// The densities of sampleGatherHemisphere and of sampleCosineHemisphere.
inline constexpr SurfaceDensity kGatherDensity{0.25f * kInvPi, 0.5f * kInvPi};
inline constexpr SurfaceDensity kCosineDensity{0.0f, kInvPi};
/// That of a point in space, which gathers from all directions alike.
inline constexpr SurfaceDensity kSphereDensity{0.25f * kInvPi, 0.0f};

/// Returns the weight of a sample taken with density `pdf` where another technique would take it with `other` (Veach
/// 1997, the power heuristic with exponent 2, one sample of each). An `other` of zero gives 1, an infinite one 0.
inline float misWeight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace lumel
