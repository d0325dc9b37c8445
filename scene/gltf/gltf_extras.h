// Lumel's own settings in a glTF file: "extras": {"lumel": {"scale": 2, "casts": false, "receives": true}}.
// Private to scene/gltf_*.cpp.
#pragma once

#include <optional>
#include <string>

#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// Overwrites those settings that extras.lumel names. Returns what is wrong with it, if anything is.
std::optional<std::string> readObjectSettings(const tinygltf::Value& extras, ObjectSettings& settings);

/// extras.lumel.page of a primitive of a baked scene: the atlas page of its lightmap; -1 where there is none.
/// A value that is no page number also reads as none: it is a foreign file then.
int readLightmapPage(const tinygltf::Value& extras);

}  // namespace lumel
