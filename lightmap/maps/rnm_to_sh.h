// Two bands of spherical harmonics from RNM maps, without rays.
#pragma once

#include <array>

#include "scene/base/math.h"

namespace lumel {

/// L0 and L of sh1 from three maps of raw projection and the flat one, per colour: the irradiances L0 + N.L that agree
/// with the four that are known, at the normal and at the three basis vectors,
///   L0 = (sum map_i - sqrt3 flat) / (3 - sqrt3),   L = sum (map_i - L0) B_i,   with L.z = flat - L0.
/// It is no projection: a light within 35 degrees of the normal gives L0 = 0. So L0 is raised, with L0 + L.z held,
/// until no part of L is more than kMostOfConstant times L0.
std::array<Vec3, 4> sh1FromRawRnm(const std::array<Vec3, 3>& rnm, const Vec3& flat);

/// What engines that store L / L0 can hold.
inline constexpr float kMostOfConstant = 4.0f;

}  // namespace lumel
