// Names of the files of a bake.
#pragma once

#include <string>

namespace lumel {

/// Whether a bake writes a file of that name.
bool isBakeFile(const std::string& name);

/// File name of a page's image: kind is "rnm0", "rnm1", "rnm2", "flat" or "aux".
std::string pageFileName(std::size_t page, const std::string& kind);

}  // namespace lumel
