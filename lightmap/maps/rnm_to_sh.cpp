#include "lightmap/maps/rnm_to_sh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lightmap/maps/rnm_basis.h"

namespace lumel {

std::array<Vec3, 4> sh1FromRawRnm(const std::array<Vec3, 3>& rnm, const Vec3& flat) {
  constexpr float kSqrt3 = std::numbers::sqrt3_v<float>;
  const Vec3 constant = (rnm[0] + rnm[1] + rnm[2] - kSqrt3 * flat) / (3.0f - kSqrt3);
  // The basis vectors' first two coordinates add up to zero: L0 takes no part in them.
  Vec3 x(0.0f), y(0.0f);
  for (std::size_t i = 0; i < 3; ++i) {
    x += kRnmBasis[i].x * rnm[i];
    y += kRnmBasis[i].y * rnm[i];
  }
  std::array<Vec3, 4> sh1{constant, x, y, Vec3(0.0f)};
  for (int c = 0; c < 3; ++c) {
    // |flat - L0| <= k L0 is L0 >= flat / (1 + k); a negative L.z is no more than L0.
    const float least = std::max(
        {flat[c] / (1.0f + kMostOfConstant), std::abs(x[c]) / kMostOfConstant, std::abs(y[c]) / kMostOfConstant});
    sh1[0][c] = std::max(constant[c], least);
    sh1[3][c] = flat[c] - sh1[0][c];
  }
  return sh1;
}

}  // namespace lumel
