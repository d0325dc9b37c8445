#include "scene/gltf/gltf_extras.h"

#include <algorithm>
#include <cfloat>

namespace lumel {

std::optional<std::string> readObjectSettings(const tinygltf::Value& extras, ObjectSettings& settings) {
  if (!extras.IsObject() || !extras.Has("lumel")) return std::nullopt;
  const auto& lumel = extras.Get("lumel");
  if (!lumel.IsObject()) return "must be an object such as {\"scale\": 2, \"casts\": false}";
  for (const std::string& key : lumel.Keys()) {
    const auto& value = lumel.Get(key);
    if (key == "scale") {
      const double scale = value.IsNumber() ? value.GetNumberAsDouble() : 0.0;
      if (!(scale > 0) || scale > double{FLT_MAX}) return "scale must be a number above 0";
      settings.texelDensityScale = static_cast<float>(scale);
    } else if (key == "casts" || key == "receives") {
      if (!value.IsBool()) return key + " must be true or false";
      (key == "casts" ? settings.casts : settings.receives) = value.Get<bool>();
    } else if (key != "page") {
      return "'" + key + "' is not known; use scale, casts or receives";
    }
  }
  return std::nullopt;
}

int readLightmapPage(const tinygltf::Value& extras) {
  if (!extras.IsObject() || !extras.Has("lumel")) return -1;
  const auto& lumel = extras.Get("lumel");
  if (!lumel.IsObject() || !lumel.Has("page") || !lumel.Get("page").IsInt()) return -1;
  return std::max(-1, lumel.Get("page").Get<int>());
}

}  // namespace lumel
