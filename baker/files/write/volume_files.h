// The files of light volumes: a description and images, whose columns are a grid's x and whose rows are y + ny * z.
#pragma once

#include <span>

#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/files/file_set.h"

namespace lumel {

/// Adds the files of volume number `number` to those of a bake. Errors: Failed.
Expected<void> writeVolume(FileSet& set, const std::filesystem::path& dir, std::size_t number,
                           const LightVolume& volume, bool half);

}  // namespace lumel
