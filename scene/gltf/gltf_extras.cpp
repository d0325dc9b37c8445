#include "scene/gltf/gltf_extras.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace lumel {

namespace {

/// Two finite numbers, or nothing.
std::optional<Vec2> pairOf(const tinygltf::Value& value) {
  if (!value.IsArray() || value.ArrayLen() != 2) return std::nullopt;
  Vec2 pair;
  for (int i = 0; i < 2; ++i) {
    const tinygltf::Value& number = value.Get(i);
    if (!number.IsNumber() || !(std::abs(number.GetNumberAsDouble()) <= double{FLT_MAX})) return std::nullopt;
    pair[i] = static_cast<float>(number.GetNumberAsDouble());
  }
  return pair;
}

}  // namespace

std::optional<std::string> readObjectSettings(const tinygltf::Value& extras, ObjectSettings& settings) {
  if (!extras.IsObject() || !extras.Has("lumel")) return std::nullopt;
  const auto& lumel = extras.Get("lumel");
  if (!lumel.IsObject()) return "must be an object such as {\"scale\": 2, \"casts\": false}";
  for (const std::string& key : lumel.Keys()) {
    const auto& value = lumel.Get(key);
    if (key == "density" || (key == "scale" && !value.IsArray())) {
      const double scale = value.IsNumber() ? value.GetNumberAsDouble() : 0.0;
      if (!(scale > 0) || scale > double{FLT_MAX}) return key + " must be a number above 0";
      settings.texelDensityScale = static_cast<float>(scale);
    } else if (key == "scale" || key == "offset") {
      if (!pairOf(value)) return key + " must be two numbers where it is the place of a lightmap";
    } else if (key == "casts" || key == "receives") {
      if (!value.IsBool()) return key + " must be true or false";
      (key == "casts" ? settings.casts : settings.receives) = value.Get<bool>();
    } else if (key != "page") {
      return "'" + key + "' is not known; use scale, casts or receives";
    }
  }
  return std::nullopt;
}

LightmapPlace readLightmapPlace(const tinygltf::Value& extras) {
  LightmapPlace place;
  place.page = readLightmapPage(extras);
  if (!extras.IsObject() || !extras.Has("lumel") || !extras.Get("lumel").IsObject()) return place;
  const auto& lumel = extras.Get("lumel");
  if (lumel.Has("scale")) place.scale = pairOf(lumel.Get("scale")).value_or(place.scale);
  if (lumel.Has("offset")) place.offset = pairOf(lumel.Get("offset")).value_or(place.offset);
  return place;
}

int readLightmapPage(const tinygltf::Value& extras) {
  if (!extras.IsObject() || !extras.Has("lumel")) return -1;
  const auto& lumel = extras.Get("lumel");
  if (!lumel.IsObject() || !lumel.Has("page") || !lumel.Get("page").IsInt()) return -1;
  return std::max(-1, lumel.Get("page").Get<int>());
}

}  // namespace lumel
