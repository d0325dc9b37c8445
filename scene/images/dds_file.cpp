#include "scene/images/dds_file.h"

#include <algorithm>
#include <cstring>

#include "scene/base/half.h"

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
  return floatFromHalf(bits);
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

std::vector<std::uint8_t> ddsHeaderBytes(const DdsHeader& header) {
  constexpr std::uint32_t kCaps = 0x1, kHeightFlag = 0x2, kWidthFlag = 0x4, kPitch = 0x8, kPixelFormat = 0x1000,
                          kMipMapCount = 0x20000, kLinearSize = 0x80000;
  constexpr std::uint32_t kFourCcFlag = 0x4, kRgbWithAlpha = 0x41, kCapsTexture = 0x1000, kCapsComplexMipMap = 0x400008,
                          kDimensionTexture2d = 3;
  const auto wordOf = [](const std::string& text) {
    std::uint32_t word = 0;
    std::memcpy(&word, text.data(), std::min(text.size(), sizeof word));
    return word;
  };
  const std::uint32_t mipFlag = header.levels > 1 ? kMipMapCount : 0;
  std::vector<std::uint32_t> words(32, 0);
  words[0] = wordOf("DDS ");
  words[1] = 124;
  words[2] = kCaps | kHeightFlag | kWidthFlag | kPixelFormat | (header.isBlocks ? kLinearSize : kPitch) | mipFlag;
  words[3] = static_cast<std::uint32_t>(header.height);
  words[4] = static_cast<std::uint32_t>(header.width);
  words[5] = static_cast<std::uint32_t>(header.firstBytes);
  words[7] = static_cast<std::uint32_t>(header.levels);
  std::memcpy(&words[8], header.note.data(), std::min(header.note.size(), kReservedBytes));
  words[19] = 32;
  words[27] = kCapsTexture | (header.levels > 1 ? kCapsComplexMipMap : 0);
  if (header.fourCc.empty() && header.dxgiFormat == 0) {
    words[20] = kRgbWithAlpha;
    words[22] = 32;
    words[23] = 0x000000FF;
    words[24] = 0x0000FF00;
    words[25] = 0x00FF0000;
    words[26] = 0xFF000000;
  } else {
    words[20] = kFourCcFlag;
    words[21] = wordOf(header.dxgiFormat != 0 ? "DX10" : header.fourCc);
  }
  if (header.dxgiFormat != 0) words.insert(words.end(), {header.dxgiFormat, kDimensionTexture2d, 0, 1, 0});
  std::vector<std::uint8_t> bytes(words.size() * sizeof(std::uint32_t));
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

}  // namespace lumel
