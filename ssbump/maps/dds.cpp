#include "ssbump/maps/dds.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <vector>

#include "scene/base/check.h"
#include "ssbump/maps/block_compression.h"

namespace lumel::ssbump {
namespace {

// Field names and values: Microsoft's "DDS_HEADER structure" and "Programming Guide for DDS".
constexpr std::uint32_t kCaps = 0x1, kHeightFlag = 0x2, kWidthFlag = 0x4, kPitch = 0x8, kPixelFormat = 0x1000,
                        kMipMapCount = 0x20000, kLinearSize = 0x80000;
constexpr std::uint32_t kFourCC = 0x4, kRgbWithAlpha = 0x41;
constexpr std::uint32_t kCapsTexture = 0x1000, kCapsComplexMipMap = 0x400008;
constexpr std::uint32_t kDxgiRgba16Float = 10, kDxgiRgba16Unorm = 11, kDimensionTexture2d = 3;

std::uint32_t fourCC(const char* text) {
  std::uint32_t value;
  std::memcpy(&value, text, 4);
  return value;
}

bool isBlock(DdsFormat format) { return format == DdsFormat::Bc1 || format == DdsFormat::Bc3; }
BlockFormat blockFormat(DdsFormat format) { return format == DdsFormat::Bc1 ? BlockFormat::Bc1 : BlockFormat::Bc3; }

std::vector<std::uint8_t> header(int width, int height, std::size_t levels, DdsFormat format, const std::string& note) {
  std::vector<std::uint32_t> words(32, 0);
  const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
  words[0] = fourCC("DDS ");
  words[1] = 124;
  words[2] = kCaps | kHeightFlag | kWidthFlag | kPixelFormat | (isBlock(format) ? kLinearSize : kPitch) |
             (levels > 1 ? kMipMapCount : 0);
  words[3] = h;
  words[4] = w;
  words[5] = isBlock(format)
                 ? static_cast<std::uint32_t>(blockBytes(blockFormat(format))) * ((w + 3) / 4) * ((h + 3) / 4)
                 : w * (format == DdsFormat::Rgba8 ? 4u : 8u);
  words[7] = static_cast<std::uint32_t>(levels);
  std::memcpy(&words[8], note.data(), std::min<std::size_t>(note.size(), 44));
  words[19] = 32;
  words[27] = kCapsTexture | (levels > 1 ? kCapsComplexMipMap : 0);
  if (format == DdsFormat::Rgba8) {
    words[20] = kRgbWithAlpha;
    words[22] = 32;
    words[23] = 0x000000FF;
    words[24] = 0x0000FF00;
    words[25] = 0x00FF0000;
    words[26] = 0xFF000000;
  } else {
    words[20] = kFourCC;
    words[21] = fourCC(format == DdsFormat::Bc1 ? "DXT1" : format == DdsFormat::Bc3 ? "DXT5" : "DX10");
  }
  if (format == DdsFormat::Rgba16 || format == DdsFormat::Rgba16Half)
    words.insert(words.end(),
                 {format == DdsFormat::Rgba16 ? kDxgiRgba16Unorm : kDxgiRgba16Float, kDimensionTexture2d, 0, 1, 0});
  std::vector<std::uint8_t> bytes(words.size() * 4);
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

/// IEEE half, rounded to nearest even; the value is finite and within range.
std::uint16_t toHalf(float value) {
  const _Float16 half = static_cast<_Float16>(value);
  std::uint16_t bits;
  std::memcpy(&bits, &half, 2);
  return bits;
}

std::vector<std::uint8_t> encodeLevel(const Image& image, DdsFormat format, const Progress& progress) {
  if (isBlock(format)) return compressBlocks(image, blockFormat(format), progress);
  const std::size_t texels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::vector<std::uint8_t> bytes(texels * (format == DdsFormat::Rgba8 ? 4 : 8));
  for (std::size_t i = 0; i < texels; ++i) {
    const float* p = &image.pixels[i * static_cast<std::size_t>(image.channels)];
    for (int c = 0; c < 4; ++c) {
      const float v = c < image.channels ? p[c] : c == 3 ? 1.0f : image.channels == 1 ? p[0] : 0.0f;
      const float held = std::clamp(v, 0.0f, 1.0f);
      const std::size_t at = i * 4 + static_cast<std::size_t>(c);
      if (format == DdsFormat::Rgba8) {
        bytes[at] = static_cast<std::uint8_t>(std::lround(held * 255));
      } else {
        const std::uint16_t word =
            format == DdsFormat::Rgba16 ? static_cast<std::uint16_t>(std::lround(held * 65535)) : toHalf(v);
        std::memcpy(&bytes[at * 2], &word, 2);
      }
    }
  }
  return bytes;
}

}  // namespace

Expected<void> writeDds(const PendingFile& file, std::span<const Image> levels, DdsFormat format,
                        const std::string& note, const Progress& progress) {
  LUMEL_CHECK(!levels.empty());
  for (const Image& level : levels)
    for (float v : level.pixels)
      if (std::isnan(v) || (format == DdsFormat::Rgba16Half && std::abs(v) > 65504.0f))
        return failure(file.place.string() + ": a value is not a number or beyond half's 65504");
  std::vector<std::uint8_t> bytes = header(levels[0].width, levels[0].height, levels.size(), format, note);
  for (const Image& level : levels) {
    const std::vector<std::uint8_t> more = encodeLevel(level, format, progress);
    if (progress.cancelled()) return interrupted();
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  return writeBytes(file, {&bytes, 1});
}

}  // namespace lumel::ssbump
