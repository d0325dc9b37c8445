// Names of the files of a bake.
#pragma once

#include <string>
#include <vector>

namespace lumel {

/// Whether a bake writes a file of that name.
bool isBakeFile(const std::string& name);

/// File name of a page's image. `kind`: the name of a map, "flat" or "aux".
std::string pageFileName(std::size_t page, const std::string& kind);

/// The kinds of a page's images that hold light: an encoding's maps and the flat one, each once.
std::vector<std::string> lightKinds(const std::vector<std::string>& mapNames);

}  // namespace lumel
