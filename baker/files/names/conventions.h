// What the numbers in a bake's files mean, in words and figures, for EXR metadata and bake.json.
#pragma once

#include "lightmap/maps/encoding.h"

namespace lumel {

/// The encoding's own conventions, and those that all maps share: units, frame, uv. Keys have no prefix.
Conventions describeConventions(const Encoding& encoding);

/// How many maps of an encoding have errors of their own in aux images: all that are sampled as they are stored, but
/// for the flat one.
std::size_t statedErrorCount(const Encoding& encoding);

/// The channels of aux images in the order in which they are handed over; files sort them. stderr is the standard error
/// of the flat map's luminance, stderr0 and so on are those of the maps of the first encoding that is stored, in their
/// order (statedErrorCount).
std::vector<std::string> auxChannels(const Encoding& encoding);
/// The same in words.
std::string describeAuxChannels(const Encoding& encoding);

}  // namespace lumel
