// Lumel's own settings in a glTF file: "extras": {"lumel": {"scale": 2, "casts": false, "light": {"radius": 0.1}}}, and
// what a baked scene says of lightmaps: {"page": 0, "scale": [0.5, 0.5], "offset": [0, 0.25], "density": 2}, where
// density is the setting that input calls scale. Modelling tools write custom properties as they can: 0 and 1 stand for
// false and true, and text that holds a JSON object or array, for lumel or anything in it, is read as if it stood
// there. Private to scene/gltf_*.cpp.
#pragma once

#include <optional>
#include <string>

#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// Overwrites those settings that extras.lumel names. Returns what is wrong with it, if anything is.
std::optional<std::string> readObjectSettings(const tinygltf::Value& extras, ObjectSettings& settings);

/// What extras.lumel.light says of a lamp, as it stands there: metres, degrees.
struct LightSettings {
  std::optional<std::string> type;  // "rectangle", "disc" or "sphere"
  std::optional<Vec2d> size;
  std::optional<double> radius, angle;
  std::optional<double> watts, lumens, nits, candela;
  std::optional<Vec3> color;
  std::optional<LightMode> mode;
  std::optional<bool> shadowMask;
  std::optional<std::string> ies;
};

/// Overwrites those settings that extras.lumel.light names, and then sets `isSet`. Returns what is wrong with it, if
/// anything is.
std::optional<std::string> readLightSettings(const tinygltf::Value& extras, LightSettings& settings, bool& isSet);
/// Tells whether extras.lumel.light is there, whatever it holds.
bool hasLightSettings(const tinygltf::Value& extras);

/// What extras.lumel.volume says of a light volume, a box around its node's origin: metres.
struct VolumeSettings {
  Vec3d size{0};
  float cell = 0.0f;  // 0: not stated
};
/// Sets `settings` where extras.lumel.volume is there. Returns what is wrong with it, if anything is.
std::optional<std::string> readVolumeSettings(const tinygltf::Value& extras, std::optional<VolumeSettings>& settings);

/// extras.lumel.page of a node or primitive of a baked scene: the atlas page of its lightmap; -1 where nothing is said.
/// A value that is no page number also reads as nothing: it is a foreign file then.
int readLightmapPage(const tinygltf::Value& extras);

/// extras.lumel.page, scale and offset of a node of a baked scene.
LightmapPlace readLightmapPlace(const tinygltf::Value& extras);

}  // namespace lumel
