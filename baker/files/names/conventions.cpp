#include "baker/files/names/conventions.h"

namespace lumel {

Conventions describeConventions(const Encoding& encoding) {
  Conventions conventions = encoding.conventions();
  conventions.at("decodeFormula") +=
      "; N = the normal map's 2 * texel - 1, green up, else (0, 0, 1); colour = albedo * L + emission";
  conventions["units"] = "irradiance / pi, linear Rec. 709; metres, candela, lux, nits; no 683 anywhere; not exposed";
  conventions["frame"] = "t = TANGENT.xyz, n = NORMAL, b = TANGENT.w * cross(n, t) of scene.glb, orthonormalised";
  conventions["uv"] =
      "TEXCOORD_1 of scene.glb, u right, v down; texel (x, y) covers u in [x, x+1)/width, v in [y, y+1)/height";
  return conventions;
}

}  // namespace lumel
