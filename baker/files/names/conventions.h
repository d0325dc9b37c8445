// What the numbers in a bake's files mean, in words and figures, for EXR metadata and bake.json.
#pragma once

#include "lightmap/maps/encoding.h"

namespace lumel {

/// The encoding's own conventions, and those that all maps share: units, frame, uv. Keys have no prefix.
Conventions describeConventions(const Encoding& encoding);

}  // namespace lumel
