// What kind of image some encoded bytes hold, by their first bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace lumel {

/// "image/png", "image/jpeg", "image/webp", "image/bmp", "image/tiff", "image/vnd.radiance", "image/x-exr",
/// "image/vnd-ms.dds", "image/gif"; empty if none of them. (TGA cannot be told by its bytes.)
std::string imageMimeType(std::span<const std::uint8_t> encoded);

}  // namespace lumel
