// The one door to GLM: the vector types that the rest of Lumel uses.
#pragma once

#define GLM_FORCE_XYZW_ONLY
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

namespace lumel {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using Vec2d = glm::dvec2;
using Vec3d = glm::dvec3;
using Mat3 = glm::mat3;  // column-major, m[column][row], as GLM and glTF have it
using Mat4 = glm::mat4;

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

inline bool isFinite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Rec. 709 luminance of a linear RGB colour.
inline float luminance(const Vec3& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

/// Area of a triangle in the plane, positive where its corners run counter-clockwise with y up.
inline double signedArea(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return 0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
}
inline double triangleArea(const Vec2d& a, const Vec2d& b, const Vec2d& c) { return std::abs(signedArea(a, b, c)); }
inline double triangleArea(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

/// How a matrix transforms cross products, so normals too: its inverse transpose times its determinant, which exists
/// for flattening matrices as well. A mirroring matrix turns them to the other side.
inline Mat3 cofactorMatrix(const Mat3& m) {
  return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

/// Bit patterns of the coordinates, with -0 as 0: equal, and sorted alike, exactly where the coordinates are equal.
inline std::array<std::uint32_t, 2> bitsOf(const Vec2& v) {
  const Vec2 clean = v + 0.0f;
  return {std::bit_cast<std::uint32_t>(clean.x), std::bit_cast<std::uint32_t>(clean.y)};
}
inline std::array<std::uint32_t, 3> bitsOf(const Vec3& v) {
  const Vec3 clean = v + 0.0f;
  return {std::bit_cast<std::uint32_t>(clean.x), std::bit_cast<std::uint32_t>(clean.y),
          std::bit_cast<std::uint32_t>(clean.z)};
}

/// i taken modulo size into [0, size).
template <class Int>
Int wrapIndex(Int i, Int size) {
  i %= size;
  return i < 0 ? i + size : i;
}

/// A right- or left-handed orthonormal frame at a surface point: tangent, bitangent, normal, all in one space.
struct Frame {
  Vec3 t{1, 0, 0};
  Vec3 b{0, 1, 0};
  Vec3 n{0, 0, 1};

  Vec3 toLocal(const Vec3& v) const { return {glm::dot(v, t), glm::dot(v, b), glm::dot(v, n)}; }
  Vec3 fromLocal(const Vec3& v) const { return v.x * t + v.y * b + v.z * n; }
};

/// An arbitrary right-handed frame about the unit vector n (Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited").
inline Frame frameAround(const Vec3& n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

/// The bake frame from an interpolated normal and tangent (xyz, w = handedness +-1), re-orthonormalised:
/// b = w * cross(n, t). Falls back to an arbitrary frame about n where t is parallel to n, zero or not finite.
inline Frame frameFromTangent(const Vec3& n, const Vec4& tangent) {
  const Vec3 raw(tangent);
  const Vec3 t = raw - n * glm::dot(n, raw);
  const float length2 = glm::dot(t, t);
  if (!(length2 > 1e-12f * glm::dot(raw, raw)) || !std::isfinite(length2)) return frameAround(n);
  const Vec3 unit = t / std::sqrt(length2);
  return {unit, (tangent.w < 0 ? -1.0f : 1.0f) * glm::cross(n, unit), n};
}

}  // namespace lumel
