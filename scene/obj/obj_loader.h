// OBJ + MTL to a Scene: one mesh and instance per object or group, one primitive per material.
// Lengths are metres, Ke is in nits. The file's v runs up and is turned to run down. Faces without normals are
// smooth within their smoothing group, flat where there is none ("s off"). Vertex colours are not read.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"
#include "scene/scene.h"

namespace lumel {

/// Loads OBJ text; `name` is for messages, MTL and image files are looked for in `folder`. Never throws; any text
/// gives a scene or an Input error that names the line.
Expected<Scene> loadObj(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                        const LoadOptions& options);

}  // namespace lumel
