// Scene files to plain data: glTF 2.0 (.gltf, .glb) and OBJ + MTL.
#pragma once

#include <filesystem>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"
#include "scene/scene.h"

namespace lumel {

/// Tells by the extension, whatever its case, whether a file is a scene: .gltf, .glb or .obj.
bool isSceneFile(const std::filesystem::path& file);

/// Loads by extension. Errors: Input, one line naming file and place ("level.gltf: accessors/12: ...").
/// A missing or unreadable texture is a warning in Scene::report; a missing buffer is an error.
Expected<Scene> loadScene(const std::filesystem::path& file, const LoadOptions& options = {});

}  // namespace lumel
