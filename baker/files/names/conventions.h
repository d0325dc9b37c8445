// What the numbers in a bake's files mean, in words and figures, for EXR metadata and bake.json.
#pragma once

#include <map>
#include <string>

#include "lightmap/maps/projection.h"

namespace lumel {

const char* nameOf(Projection projection);  // "raw", "flat", "fit"
const char* nameOf(RnmDecode decode);       // "squared", "linear", "linear-normalized"

/// The decode that every bake is made for.
inline constexpr RnmDecode kBakeDecode = RnmDecode::Squared;

/// Key and text, keys without a prefix: basis, order, decode, projection, units, frame, uv.
std::map<std::string, std::string> describeConventions(Projection projection);

}  // namespace lumel
