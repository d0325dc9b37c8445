// Lumel's own settings in a glTF file: "extras": {"lumel": {"scale": 2, "casts": false, "receives": true}}, and what a
// baked scene says of lightmaps: {"page": 0, "scale": [0.5, 0.5], "offset": [0, 0.25], "density": 2}, where density is
// the setting that input calls scale.
// Private to scene/gltf_*.cpp.
#pragma once

#include <optional>
#include <string>

#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// Overwrites those settings that extras.lumel names. Returns what is wrong with it, if anything is.
std::optional<std::string> readObjectSettings(const tinygltf::Value& extras, ObjectSettings& settings);

/// extras.lumel.page of a node or primitive of a baked scene: the atlas page of its lightmap; -1 where nothing is said.
/// A value that is no page number also reads as nothing: it is a foreign file then.
int readLightmapPage(const tinygltf::Value& extras);

/// extras.lumel.page, scale and offset of a node of a baked scene.
LightmapPlace readLightmapPlace(const tinygltf::Value& extras);

}  // namespace lumel
