#include "baker/files/names/conventions.h"

namespace lumel {

Conventions describeConventions(const Encoding& encoding) {
  Conventions conventions = encoding.conventions();
  conventions.at("decodeFormula") +=
      "; N = the normal map's 2 * texel - 1, green up, else (0, 0, 1); colour = albedo * L + emission";
  conventions["units"] = "irradiance / pi, linear Rec. 709; metres, candela, lux, nits; no 683 anywhere; not exposed";
  conventions["frame"] = "t = TANGENT.xyz, n = NORMAL, b = TANGENT.w * cross(n, t) of scene.glb, orthonormalised";
  conventions["uv"] =
      "TEXCOORD_1 of scene.glb, times extras.lumel.scale plus offset of its node where it has them, u right, v down; "
      "texel (x, y) covers u in [x, x+1)/width, v in [y, y+1)/height";
  return conventions;
}

std::size_t statedErrorCount(const Encoding& encoding) {
  return encoding.source() || encoding.mapNames().front() == kFlatMap ? 0 : encoding.mapCount();
}

std::vector<std::string> auxChannels(const Encoding& encoding) {
  std::vector<std::string> channels = {"coverage", "validity", "stderr", "samples"};
  for (std::size_t k = 0; k < statedErrorCount(encoding); ++k) channels.push_back("stderr" + std::to_string(k));
  return channels;
}

std::string describeAuxChannels(const Encoding& encoding) {
  std::string text = "channels";
  for (const std::string& name : auxChannels(encoding)) text += (text == "channels" ? " " : ", ") + name;
  return text +
         ", by name (EXR files sort channels); stderr: standard error of the flat map's luminance as it is in its "
         "file, "
         "stderr<i>: of map i; NaN: not known";
}

}  // namespace lumel
