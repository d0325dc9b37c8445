#include "baker/files/names/conventions.h"

#include <cstdio>

namespace lumel {

const char* nameOf(Projection projection) {
  switch (projection) {
    case Projection::Raw:
      return "raw";
    case Projection::Flat:
      return "flat";
    case Projection::Fit:
      return "fit";
  }
  return "?";
}

const char* nameOf(RnmDecode decode) {
  switch (decode) {
    case RnmDecode::Squared:
      return "squared";
    case RnmDecode::Linear:
      return "linear";
    case RnmDecode::LinearNormalized:
      return "linear-normalized";
  }
  return "?";
}

std::map<std::string, std::string> describeConventions(Projection projection) {
  std::string basis;
  for (std::size_t i = 0; i < kRnmBasis.size(); ++i) {
    const Vec3& b = kRnmBasis[i];
    char text[96];
    std::snprintf(text, sizeof text, "%sB%zu = (%.9g, %.9g, %.9g)", i == 0 ? "" : "; ", i, static_cast<double>(b.x),
                  static_cast<double>(b.y), static_cast<double>(b.z));
    basis += text;
  }
  return {
      {"basis", basis + "; in tangent space (t, b, n), orthonormal"},
      {"order", "map i belongs to Bi; a frame of the other handedness swaps maps 1 and 2"},
      {"decode", nameOf(kBakeDecode)},
      {"decodeFormula",
       "L = sum w_i map_i, w_i = saturate(N.B_i)^2 / sum_j saturate(N.B_j)^2; N = the normal map's 2 * texel - 1, "
       "green up, else (0, 0, 1); colour = albedo * L + emission"},
      {"projection", nameOf(projection)},
      {"units", "irradiance / pi, linear Rec. 709; metres, candela, lux, nits; no 683 anywhere; not exposed"},
      {"frame", "t = TANGENT.xyz, n = NORMAL, b = TANGENT.w * cross(n, t) of scene.glb, orthonormalised"},
      {"uv", "TEXCOORD_1 of scene.glb, u right, v down; texel (x, y) covers u in [x, x+1)/width, v in [y, y+1)/height"},
  };
}

}  // namespace lumel
