// glTF 2.0 (.gltf and .glb) to a Scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"
#include "scene/scene.h"

namespace lumel {

/// Loads a .gltf or .glb from its bytes. `name` is for messages; relative references start from `folder`.
/// Never throws; any bytes give a scene or an Input error.
Expected<Scene> loadGltf(std::vector<std::uint8_t> bytes, const std::string& name, const std::filesystem::path& folder,
                         const LoadOptions& options);

}  // namespace lumel
