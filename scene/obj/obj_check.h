// A first pass over OBJ text: what tinyobjloader would read as 0 or not check at all, with the line it is on.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lumel {

/// The first thing wrong, as "line 12: a face refers to vertex 9, but there are 8": coordinates that are no finite
/// numbers, face indices that are 0 or out of range, polygons with more corners than can be read (255).
std::optional<std::string> checkObjText(std::string_view text);

}  // namespace lumel
