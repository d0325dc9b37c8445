// 16 values side by side: a wave of texels is worked on in plain loops over its lanes, which the compiler turns into
// vector code for the processor at hand.
#pragma once

#include <array>
#include <cstddef>

#include "scene/each_cpu.h"
#include "scene/math.h"

namespace lumel {

/// `a` where `condition` holds, else `b`. Both are always computed: with ?: and && loops over lanes may keep branches
/// and then do not become vector code.
[[gnu::always_inline]] inline float pick(bool condition, float a, float b) { return condition ? a : b; }
[[gnu::always_inline]] inline Vec3 pick(bool condition, const Vec3& a, const Vec3& b) {
  return {pick(condition, a.x, b.x), pick(condition, a.y, b.y), pick(condition, a.z, b.z)};
}
/// std::clamp by value.
[[gnu::always_inline]] inline float within(float x, float least, float most) {
  const float low = x < least ? least : x;
  return low < most ? low : most;
}

/// Texels that advance in step: one lane each, one packet per ray call.
inline constexpr int kLanes = 16;

/// As wide as a float, so that both fit into one loop.
using LaneFlags = std::array<int, kLanes>;

struct alignas(64) Vec3Lanes {
  float x[kLanes] = {};
  float y[kLanes] = {};
  float z[kLanes] = {};

  Vec3 operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(std::size_t lane, const Vec3& v) {
    x[lane] = v.x;
    y[lane] = v.y;
    z[lane] = v.z;
  }
};

struct FrameLanes {
  Vec3Lanes t, b, n;

  Frame operator[](std::size_t lane) const { return {t[lane], b[lane], n[lane]}; }
  void set(std::size_t lane, const Frame& frame) {
    t.set(lane, frame.t);
    b.set(lane, frame.b);
    n.set(lane, frame.n);
  }
};

}  // namespace lumel
