// Lists as options and files write them.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace lumel {

/// The parts of a text between separators: one more than there are of these, empty ones too.
inline std::vector<std::string> splitText(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    parts.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

}  // namespace lumel
