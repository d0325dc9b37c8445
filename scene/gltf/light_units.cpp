#include "scene/gltf/light_units.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace lumel {
namespace {

constexpr double kLumensPerWatt = 683.0;
constexpr double kSphere = 4.0 * std::numbers::pi;

LightScale scaleOf(LightUnits units) {
  switch (units) {
    case LightUnits::Blender:
      return {1.0 / kLumensPerWatt, 1.0 / kLumensPerWatt, 1.0 / kLumensPerWatt};
    case LightUnits::BlenderRaw:
      return {1.0 / kSphere, 1.0, 1.0 / kLumensPerWatt};
    default:
      return {};
  }
}

/// Tells whether a number has at most four significant digits. One of a hundred numbers drawn at random has.
bool isRound(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return true;
  const double scaled = value / std::pow(10.0, std::floor(std::log10(value)) - 3.0);
  constexpr double kFloatRounding = 1e-6;  // relative: a few steps of a float, which is what exporters convert
  return std::abs(scaled - std::round(scaled)) <= kFloatRounding * scaled;
}

/// Tells whether the powers of all lamps are round where they are in `units`: watts of points and spots, watts per
/// square metre of suns.
bool areRound(const std::vector<tinygltf::Light>& lights, LightUnits units) {
  const LightScale scale = scaleOf(units);
  return std::all_of(lights.begin(), lights.end(), [&](const tinygltf::Light& light) {
    return isRound(light.type == "directional" ? light.intensity * scale.lux
                                               : light.intensity * scale.candela * kSphere);
  });
}

/// Version of Blender's exporter that wrote the file, as 100 * major + minor; -1: another program.
int blenderVersion(const std::string& generator) {
  const std::string name = "Khronos glTF Blender I/O";
  if (generator.rfind(name, 0) != 0) return -1;
  const std::size_t v = generator.find(" v", name.size());
  int major = 0, minor = 0;
  if (v == std::string::npos) return 0;
  const char* end = generator.data() + generator.size();
  const auto first = std::from_chars(generator.data() + v + 2, end, major);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '.') return 0;
  if (std::from_chars(first.ptr + 1, end, minor).ec != std::errc()) return 0;
  return 100 * std::clamp(major, 0, 1000) + std::clamp(minor, 0, 99);
}

std::string describe(LightUnits units) {
  const std::string by = "light units: lamps of Blender's exporter are taken ";
  switch (units) {
    case LightUnits::Blender:
      return by + "as 683 times watts, its default, and divided by 683 (--light-units gltf: as they stand)";
    case LightUnits::BlenderRaw:
      return by +
             "as plain watts (lighting mode Raw); points and spots are divided by 4 pi (--light-units gltf: as "
             "they stand)";
    default:
      return by +
             "as written without the factor 683 (lighting mode Unitless), since their powers are round so "
             "(--light-units blender: divided by 683)";
  }
}

}  // namespace

LightScale lightScaleOf(const GltfDocument& document, std::vector<std::string>& notes) {
  LightUnits units = document.options.lightUnits;
  if (units != LightUnits::Auto) return scaleOf(units);
  constexpr int kFirstWithModes = 304;
  const int version = blenderVersion(document.model.asset.generator);
  if (version < 0) return {};
  const std::vector<tinygltf::Light>& lights = document.model.lights;
  const LightUnits usual = version >= kFirstWithModes ? LightUnits::Blender : LightUnits::BlenderRaw;
  units = usual;
  if (lights.empty()) return scaleOf(usual);
  if (!areRound(lights, usual))
    for (const LightUnits other : {LightUnits::Blender, LightUnits::Gltf, LightUnits::BlenderRaw})
      if (areRound(lights, other)) {
        units = other;
        break;
      }
  notes.push_back(document.name + ": " + describe(units));
  return scaleOf(units);
}

}  // namespace lumel
