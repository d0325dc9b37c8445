// Photometric files of lamps: ANSI/IES LM-63 (1986 to 2019), ".ies".
#pragma once

#include <string>
#include <string_view>

#include "scene/base/expected.h"
#include "scene/light_profile.h"

namespace lumel {

/// Reads a file of photometric type C. Horizontal angles that stand for others by symmetry (0 to 90, 0 to 180, 90 to
/// 270) are written out to the whole circle. Candela include the file's multiplier and ballast factors. Errors: Input,
/// "line N: problem; what to do", without a file name.
Expected<LightProfile> parseIes(std::string_view text);

}  // namespace lumel
