// What the numbers in a bake's files mean, in words and figures, for EXR metadata and bake.json.
#pragma once

#include "lightmap/maps/encoding.h"

namespace lumel {

/// The encoding's own conventions, and those that all maps share: units, frame, uv. Keys have no prefix.
Conventions describeConventions(const Encoding& encoding);

/// The channels of aux images in the order in which they are handed over; files sort them. stderr is the standard error
/// of the flat map's luminance, stderr0 and so on are those of the encoding's maps in their order.
std::vector<std::string> auxChannels(const Encoding& encoding);
/// The same in words.
std::string describeAuxChannels(const Encoding& encoding);

}  // namespace lumel
