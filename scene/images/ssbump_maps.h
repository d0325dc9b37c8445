// The ssbump maps of materials: files beside the scene's own images.
#pragma once

#include <filesystem>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"
#include "scene/scene.h"

namespace lumel {

/// Gives `material` the map in `file`, on the UVs of its normal map, else of its colour map. Errors: Input: no such
/// file, or no image of a known type.
Expected<void> setSsbumpMap(Scene& scene, Material& material, const std::filesystem::path& file);

/// Gives materials the maps that `options` name, which go before those of the scene file. Errors: Input, those of
/// setSsbumpMap, and a name that no material has.
Expected<void> assignSsbumpMaps(Scene& scene, const LoadOptions& options);

}  // namespace lumel
