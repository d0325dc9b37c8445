// Bytes from outside: whole files, data URIs, and where a scene file's references may point.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"

namespace lumel {

/// The whole of a regular file. Errors: Input, "FILE: no such file" or "FILE: cannot be read: reason".
Expected<std::vector<std::uint8_t>> readFile(const std::filesystem::path& file);

std::string lowerCase(std::string text);

/// The extension in lower case, with its dot: ".png"; empty if there is none.
std::string lowerCaseExtension(const std::filesystem::path& file);

inline bool isDataUri(std::string_view uri) { return uri.substr(0, 5) == "data:"; }

/// The payload of "data:[mime];base64,...". Errors: Input, without a file name (the caller knows the place).
Expected<std::vector<std::uint8_t>> decodeDataUri(std::string_view uri);

/// "%20" -> " "; malformed escapes stay as they are.
std::string percentDecode(std::string_view text);

/// The file that `reference` (a relative path) names in a scene in `folder`. Refused unless options allow it:
/// absolute paths, other URI schemes, and paths that leave the folder, also through a symbolic link.
/// The file need not exist. Errors: Input, without a file name.
Expected<std::filesystem::path> resolveReference(const std::filesystem::path& folder, const std::string& reference,
                                                 const LoadOptions& options);

}  // namespace lumel
