// DirectDraw Surface files: a texture with its whole mip chain, plain or block compressed.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/files/file_set.h"
#include "scene/image.h"

namespace lumel::ssbump {

enum class DdsFormat { Rgba8, Rgba16, Rgba16Half, Bc1, Bc3 };

/// Levels from the largest down, each max(1, floor(side / 2)) of the one before; 1 to 4 channels (grey replicates,
/// alpha 1). `note` (up to 40 characters, for the convention) goes into the header's reserved words, where readers skip
/// it. Errors: Failed (cannot write, a value that half cannot
/// hold), Interrupted.
Expected<void> writeDds(const PendingFile& file, std::span<const Image> levels, DdsFormat format,
                        const std::string& note = {}, const Progress& progress = noProgress());

}  // namespace lumel::ssbump
