// Any number of directions instead of the three of radiosity normal mapping, for maps with more channels.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/math.h"

namespace lumel::ssbump {

/// A text file of one unit vector per line, "x y z" in (t, b, n); '#' starts a comment. Errors: Input with the line
/// (not three numbers, length not 1 within 1e-3, at or below the horizon, none, more than 64).
Expected<std::vector<Vec3>> readBasis(const std::filesystem::path& file);

}  // namespace lumel::ssbump
