// What OpenImageIO leaves out of DDS files: 16-bit and half texels, the note in the reserved words, and writing them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/images/loaded_image.h"

namespace lumel {

/// The line of text in the header's reserved words; empty where there is none.
std::string ddsNote(std::span<const std::uint8_t> file);

/// The first image of a DDS file with DirectX 10's header and four channels of 16 bits or halves; nothing where it is
/// another kind of file. Errors: Input (cut off, no pixels), naming it `name`.
std::optional<Expected<LoadedImage>> readWideDds(std::span<const std::uint8_t> file, const std::string& name);

/// What the header of a 2D texture says. Its texels are named by four characters, or by Direct3D 10's DXGI_FORMAT;
/// without either they are RGBA of 8 bits each.
struct DdsHeader {
  int width = 0;
  int height = 0;
  std::size_t levels = 1;
  bool isBlocks = false;       // texels share blocks
  std::size_t firstBytes = 0;  // of the first level where they do, else of its first row
  std::string fourCc{};
  std::uint32_t dxgiFormat = 0;
  std::string note{};  // a line of up to 44 characters for the reserved words, where readers skip it
};

/// The bytes before the levels, which follow from the largest down. Source: Microsoft, "DDS_HEADER structure" and
/// "DDS_HEADER_DXT10".
std::vector<std::uint8_t> ddsHeaderBytes(const DdsHeader& header);

}  // namespace lumel
