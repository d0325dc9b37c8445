// Pictures for people: panels in a grid.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "ssbump/bake.h"

namespace lumel::ssbump {

/// Three-channel panels of one size, left to right and top to bottom, with a grey gap.
Image panelGrid(std::span<const Image> panels, int columns);

/// Two rows of four panels, each at most `side` wide: heights, normals, weights without occlusion, weights with
/// occlusion; recovered normals, ambient occlusion, lit from the right, lit from the top. Weights are shown times 1.5
/// (flat is mid grey). 8-bit PNG or any other image type. Errors: those of the bake and of writing.
Expected<void> writeContactSheet(const std::filesystem::path& input, const BakeSettings& settings, int side,
                                 const std::filesystem::path& output, Progress& progress);

}  // namespace lumel::ssbump
