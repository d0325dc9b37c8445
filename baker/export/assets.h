// Files that exports carry along as they are: loaders, scripts, instructions. They lie in assets/ and are part of the
// program.
#pragma once

#include <string_view>

namespace lumel {

/// The content of assets/`name`, which must be one of them.
std::string_view asset(std::string_view name);

}  // namespace lumel
