// The light volumes of a bake, read from its files.
#pragma once

#include <filesystem>
#include <vector>

#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"

namespace lumel {

/// All of them, in their order; none where the bake has none. Errors: Input, naming file and cause.
Expected<std::vector<LightVolume>> readVolumes(const std::filesystem::path& dir);

}  // namespace lumel
