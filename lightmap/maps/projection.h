// How light from a direction is spread over the three RNM maps: the kernels K_i, c_i = (1/pi) Integral L(w) K_i(w) dw,
// and the per-texel step after the sum. Derivations and known values: lightmap/maps/README.md.
#pragma once

#include <array>
#include <vector>

#include "lightmap/maps/rnm_basis.h"
#include "scene/base/math.h"

namespace lumel {

enum class Projection {
  Raw,     // K_i = max(0, w.B_i)
  Flat,    // raw, then scaled per texel and colour so that the maps' mean is the flat irradiance / pi (default)
  Fit,     // least squares for the squared decode over normals within 30 degrees of flat, non-negative, exact at flat
  Signed,  // K_i = w.B_i, for the linear decode: maps may be negative
};
const char* nameOf(Projection projection);  // "raw", "flat", "fit", "signed"

/// Evaluates the three kernels for a unit direction in tangent space. Directions with w.z <= 0 (below the surface)
/// give zero: light comes from above the surface only. Fit interpolates a table, within 5e-4 of the exact kernels; its
/// three add up to 3 w.z to rounding; those of Signed to sqrt(3) w.z. Flat's kernels are Raw's (finishTexel does the
/// rest).
class RnmKernels {
 public:
  explicit RnmKernels(Projection projection);
  Vec3 operator()(const Vec3& dirTangent) const;
  /// Whether the kernels are max(0, w.B_i) above the surface, so that a caller may compute them in place.
  bool clampedDots() const { return projection_ == Projection::Raw || projection_ == Projection::Flat; }
  /// The same without the max.
  bool plainDots() const { return projection_ == Projection::Signed; }

  /// An upper bound of every kernel's size over the hemisphere (for sampling densities and for tests).
  float bound() const { return bound_; }

 private:
  Projection projection_;
  float bound_ = 1.0f;
  // Fit: the kernels before their constraints are matrix_ * direction, plus table_ near the horizon.
  Mat3 matrix_{1.0f};
  std::vector<Vec3> table_;
};

/// What becomes of a texel's three sums: for Flat, scales rnm so that its mean is `flat` in each colour (where the
/// mean is zero: each map = flat). The others return their input.
std::array<Vec3, 3> finishTexel(Projection projection, const std::array<Vec3, 3>& rnm, const Vec3& flat);

/// The light that a consumer decodes for a tangent-space normal: sum of w_i * maps[i].
Vec3 decodeRnm(const std::array<Vec3, 3>& maps, const Vec3& normalTangent, RnmDecode decode = RnmDecode::Squared);

}  // namespace lumel
