// What OpenImageIO leaves out of DDS files: 16-bit and half texels, and the note in the reserved words.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "scene/base/expected.h"
#include "scene/images/loaded_image.h"

namespace lumel {

/// The line of text in the header's reserved words; empty where there is none.
std::string ddsNote(std::span<const std::uint8_t> file);

/// The first image of a DDS file with DirectX 10's header and four channels of 16 bits or halves; nothing where it is
/// another kind of file. Errors: Input (cut off, no pixels), naming it `name`.
std::optional<Expected<LoadedImage>> readWideDds(std::span<const std::uint8_t> file, const std::string& name);

}  // namespace lumel
