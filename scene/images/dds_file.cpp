#include "scene/images/dds_file.h"

#include <algorithm>
#include <cstring>

namespace lumel {
namespace {

// Places and values: Microsoft's "DDS_HEADER structure" and "DDS_HEADER_DXT10 structure"; the header begins after 4
// bytes.
constexpr std::size_t kHeight = 12, kWidth = 16, kReserved = 32, kReservedBytes = 44, kFourCC = 84, kDxgiFormat = 128,
                      kTexels = 148;
constexpr std::uint32_t kDxgiRgba16Float = 10, kDxgiRgba16Unorm = 11;
constexpr std::uint32_t kMostTexelsOnASide = 65536;

std::uint32_t wordAt(std::span<const std::uint8_t> file, std::size_t at) {
  std::uint32_t word;
  std::memcpy(&word, &file[at], sizeof word);
  return word;
}

bool says(std::span<const std::uint8_t> file, std::size_t at, const char* text) {
  return file.size() >= at + 4 && std::memcmp(&file[at], text, 4) == 0;
}

float valueAt(std::span<const std::uint8_t> file, std::size_t at, bool half) {
  std::uint16_t bits;
  std::memcpy(&bits, &file[at], sizeof bits);
  if (!half) return static_cast<float>(bits) / 65535.0f;
  _Float16 value;
  std::memcpy(&value, &bits, sizeof bits);
  return static_cast<float>(value);
}

}  // namespace

std::string ddsNote(std::span<const std::uint8_t> file) {
  if (!says(file, 0, "DDS ") || file.size() < kReserved + kReservedBytes) return {};
  const char* first = reinterpret_cast<const char*>(&file[kReserved]);
  const char* last = std::find(first, first + kReservedBytes, '\0');
  const bool isText = std::all_of(first, last, [](char c) { return c >= ' ' && c <= '~'; });
  return isText ? std::string(first, last) : std::string();
}

std::optional<Expected<LoadedImage>> readWideDds(std::span<const std::uint8_t> file, const std::string& name) {
  if (!says(file, 0, "DDS ") || !says(file, kFourCC, "DX10") || file.size() < kTexels) return std::nullopt;
  const std::uint32_t format = wordAt(file, kDxgiFormat);
  if (format != kDxgiRgba16Float && format != kDxgiRgba16Unorm) return std::nullopt;
  const std::uint32_t width = wordAt(file, kWidth), height = wordAt(file, kHeight);
  if (width == 0 || height == 0 || width > kMostTexelsOnASide || height > kMostTexelsOnASide)
    return inputError(name + ": an image of " + std::to_string(width) + "x" + std::to_string(height) + " texels");
  const std::size_t values = 4 * static_cast<std::size_t>(width) * height;
  if (file.size() < kTexels + 2 * values) return inputError(name + ": is cut off: the file ends before the image does");
  LoadedImage loaded;
  loaded.format = "dds";
  loaded.bitsPerChannel = 16;
  loaded.isFloat = format == kDxgiRgba16Float;
  loaded.channelNames = {"R", "G", "B", "A"};
  loaded.image = Image(static_cast<int>(width), static_cast<int>(height), 4);
  for (std::size_t i = 0; i < values; ++i) loaded.image.pixels[i] = valueAt(file, kTexels + 2 * i, loaded.isFloat);
  return loaded;
}

}  // namespace lumel
