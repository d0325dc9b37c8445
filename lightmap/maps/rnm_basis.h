// The radiosity-normal-mapping basis, defined once: used by baker, ssbump, compositor and shader snippets.
// Source: Green 2007, "Efficient Self-Shadowed Radiosity Normal Mapping", with the errata named in
// lightmap/maps/README.md.
#pragma once

#include <array>

#include "scene/base/math.h"

namespace lumel {

/// B0, B1, B2 in tangent space (t, b, n): orthonormal, each 54.7 degrees off the normal.
inline constexpr std::array<Vec3, 3> kRnmBasis = {
    Vec3(0.816496580927726f, 0.0f, 0.577350269189626f),
    Vec3(-0.408248290463863f, 0.707106781186548f, 0.577350269189626f),
    Vec3(-0.408248290463863f, -0.707106781186548f, 0.577350269189626f),
};

/// How three lightmaps become the light on a normal: an encode and a decode are a pair, and the file says which.
/// Squared: w_i = saturate(N.B_i)^2 / sum_j saturate(N.B_j)^2.
/// Linear: w_i = saturate(N.B_i), not divided. LinearNormalized: divided by their sum.
enum class RnmDecode { Squared, Linear, LinearNormalized };
const char* nameOf(RnmDecode decode);  // "squared", "linear", "linear-normalized"

/// Weights of the three maps for a unit tangent-space normal. Where no basis vector sees the normal: all zero.
Vec3 rnmWeights(const Vec3& normalTangent, RnmDecode decode = RnmDecode::Squared);

}  // namespace lumel
