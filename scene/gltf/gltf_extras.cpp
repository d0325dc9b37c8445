#include "scene/gltf/gltf_extras.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>

namespace lumel {
namespace {

using Problem = std::optional<std::string>;

/// A setting, with text that holds JSON in the place of what it says.
tinygltf::Value unquoted(const tinygltf::Value& value) {
  if (!value.IsString()) return value;
  const auto& text = value.Get<std::string>();
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos || (text[first] != '{' && text[first] != '[')) return value;
  return valueOfJson(text).value_or(value);
}

/// extras.lumel; nothing where it is not there.
std::optional<tinygltf::Value> lumelOf(const tinygltf::Value& extras) {
  if (!extras.IsObject() || !extras.Has("lumel")) return std::nullopt;
  return unquoted(extras.Get("lumel"));
}

std::optional<bool> truthOf(const tinygltf::Value& value) {
  if (value.IsBool()) return value.Get<bool>();
  if (!value.IsNumber()) return std::nullopt;
  const double number = value.GetNumberAsDouble();
  if (number == 0.0 || number == 1.0) return number == 1.0;
  return std::nullopt;
}

Problem readNumber(const tinygltf::Value& value, const std::string& key, double most, const char* unit,
                   std::optional<double>& number) {
  const double read = value.IsNumber() ? value.GetNumberAsDouble() : -1.0;
  if (!(read >= 0.0) || read > most) {
    const std::string range = most < 1e6 ? "from 0 to " + std::to_string(static_cast<int>(most)) : "0 or more";
    return key + " must be a number of " + unit + ", " + range;
  }
  number = read;
  return std::nullopt;
}

/// Reads `count` numbers of at least 0.
template <int kCount, class Vector>
Problem readVector(const tinygltf::Value& source, const std::string& problem, Vector& vector) {
  const tinygltf::Value value = unquoted(source);
  if (!value.IsArray() || value.ArrayLen() != static_cast<std::size_t>(kCount)) return problem;
  for (int i = 0; i < kCount; ++i) {
    const tinygltf::Value& part = value.Get(i);
    const double number = part.IsNumber() ? part.GetNumberAsDouble() : -1.0;
    if (!(number >= 0.0) || number > double{FLT_MAX}) return problem;
    vector[i] = static_cast<typename Vector::value_type>(number);
  }
  return std::nullopt;
}

Problem readWord(const tinygltf::Value& value, const std::string& problem, std::span<const char* const> words,
                 std::size_t& index) {
  if (!value.IsString()) return problem;
  const auto found = std::ranges::find(words, value.Get<std::string>());
  if (found == words.end()) return problem;
  index = static_cast<std::size_t>(found - words.begin());
  return std::nullopt;
}

Problem readLightSetting(const std::string& key, const tinygltf::Value& value, LightSettings& settings) {
  constexpr std::array kTypes = {"rectangle", "disc", "sphere"};
  constexpr std::array kModes = {"all", "indirect", "none"};
  std::size_t word = 0;
  if (key == "type") {
    auto problem = readWord(value, "type must be \"rectangle\", \"disc\" or \"sphere\"", kTypes, word);
    if (!problem) settings.type = kTypes[word];
    return problem;
  }
  if (key == "mode") {
    auto problem = readWord(value, "mode must be \"all\", \"indirect\" or \"none\"", kModes, word);
    if (!problem) settings.mode = static_cast<LightMode>(word);
    return problem;
  }
  if (key == "shadow_mask") {
    settings.shadowMask = truthOf(value);
    return settings.shadowMask ? Problem() : Problem("shadow_mask must be true or false");
  }
  if (key == "ies") {
    if (!value.IsString() || value.Get<std::string>().empty()) return "ies must be the name of a file";
    settings.ies = value.Get<std::string>();
    return std::nullopt;
  }
  if (key == "size") {
    settings.size.emplace(0.0);
    constexpr const char* kProblem = "size must be two numbers of metres above 0, [WIDTH, HEIGHT]";
    auto problem = readVector<2>(value, kProblem, *settings.size);
    return !problem && !(settings.size->x > 0.0 && settings.size->y > 0.0) ? Problem(kProblem) : problem;
  }
  if (key == "color") {
    settings.color.emplace(1.0f);
    return readVector<3>(value, "color must be three numbers, 0 or more: [RED, GREEN, BLUE]", *settings.color);
  }
  if (key == "radius") return readNumber(value, key, 1e18, "metres", settings.radius);
  if (key == "angle") return readNumber(value, key, 90.0, "degrees", settings.angle);
  for (const auto& [name, number] : {std::pair{"watts", &settings.watts}, std::pair{"lumens", &settings.lumens},
                                     std::pair{"nits", &settings.nits}, std::pair{"candela", &settings.candela}})
    if (key == name) return readNumber(value, key, 1e37, name, *number);
  return "'" + key +
         "' is not known; use type, size, radius, angle, watts, lumens, nits, candela, color, ies, mode or shadow_mask";
}

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
  const auto lumel = lumelOf(extras);
  if (!lumel) return std::nullopt;
  if (!lumel->IsObject()) return "must be an object such as {\"scale\": 2, \"casts\": false}";
  for (const std::string& key : lumel->Keys()) {
    const auto& value = lumel->Get(key);
    if (key == "density" || (key == "scale" && !value.IsArray())) {
      const double scale = value.IsNumber() ? value.GetNumberAsDouble() : 0.0;
      if (!(scale > 0) || scale > double{FLT_MAX}) return key + " must be a number above 0";
      settings.texelDensityScale = static_cast<float>(scale);
    } else if (key == "scale" || key == "offset") {
      if (!pairOf(value)) return key + " must be two numbers where it is the place of a lightmap";
    } else if (key == "casts" || key == "receives") {
      const std::optional<bool> truth = truthOf(value);
      if (!truth) return key + " must be true or false";
      (key == "casts" ? settings.casts : settings.receives) = *truth;
    } else if (key != "page" && key != "light" && key != "volume") {
      return "'" + key + "' is not known; use scale, casts, receives, light or volume";
    }
  }
  return std::nullopt;
}

LightmapPlace readLightmapPlace(const tinygltf::Value& extras) {
  LightmapPlace place;
  place.page = readLightmapPage(extras);
  const auto lumel = lumelOf(extras);
  if (!lumel || !lumel->IsObject()) return place;
  if (lumel->Has("scale")) place.scale = pairOf(lumel->Get("scale")).value_or(place.scale);
  if (lumel->Has("offset")) place.offset = pairOf(lumel->Get("offset")).value_or(place.offset);
  return place;
}

bool hasLightSettings(const tinygltf::Value& extras) {
  const auto lumel = lumelOf(extras);
  return lumel && lumel->IsObject() && lumel->Has("light");
}

std::optional<std::string> readLightSettings(const tinygltf::Value& extras, LightSettings& settings, bool& isSet) {
  if (!hasLightSettings(extras)) return std::nullopt;
  const tinygltf::Value light = unquoted(lumelOf(extras)->Get("light"));
  if (!light.IsObject()) return "must be an object such as {\"radius\": 0.1}";
  for (const std::string& key : light.Keys())
    if (auto problem = readLightSetting(key, light.Get(key), settings)) return problem;
  isSet = true;
  return std::nullopt;
}

std::optional<std::string> readVolumeSettings(const tinygltf::Value& extras, std::optional<VolumeSettings>& settings) {
  const auto lumel = lumelOf(extras);
  if (!lumel || !lumel->IsObject() || !lumel->Has("volume")) return std::nullopt;
  const tinygltf::Value volume = unquoted(lumel->Get("volume"));
  constexpr const char* kProblem = "must be an object such as {\"size\": [4, 3, 4], \"cell\": 0.5}, in metres";
  if (!volume.IsObject() || !volume.Has("size")) return kProblem;
  settings.emplace();
  for (const std::string& key : volume.Keys()) {
    if (key == "size") {
      if (auto problem = readVector<3>(volume.Get(key), "size must be three numbers of metres", settings->size))
        return problem;
    } else if (key == "cell") {
      const double cell = volume.Get(key).IsNumber() ? volume.Get(key).GetNumberAsDouble() : 0.0;
      if (!(cell > 0.0) || cell > 1e18) return "cell must be a number of metres above 0";
      settings->cell = static_cast<float>(cell);
    } else {
      return "'" + key + "' is not known; use size and cell";
    }
  }
  return std::nullopt;
}

int readLightmapPage(const tinygltf::Value& extras) {
  const auto lumel = lumelOf(extras);
  if (!lumel || !lumel->IsObject() || !lumel->Has("page") || !lumel->Get("page").IsInt()) return -1;
  return std::max(-1, lumel->Get("page").Get<int>());
}

}  // namespace lumel
