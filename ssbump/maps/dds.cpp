#include "ssbump/maps/dds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "scene/base/check.h"
#include "scene/base/half.h"
#include "scene/images/dds_file.h"
#include "ssbump/maps/block_compression.h"

namespace lumel::ssbump {
namespace {

constexpr std::uint32_t kDxgiRgba16Float = 10, kDxgiRgba16Unorm = 11;

bool isBlock(DdsFormat format) { return format == DdsFormat::Bc1 || format == DdsFormat::Bc3; }
BlockFormat blockFormat(DdsFormat format) { return format == DdsFormat::Bc1 ? BlockFormat::Bc1 : BlockFormat::Bc3; }

std::vector<std::uint8_t> header(int width, int height, std::size_t levels, DdsFormat format, const std::string& note) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  DdsHeader header{.width = width, .height = height, .levels = levels, .isBlocks = isBlock(format), .note = note};
  header.firstBytes = isBlock(format) ? blockBytes(blockFormat(format)) * ((w + 3) / 4) * ((h + 3) / 4)
                                      : w * (format == DdsFormat::Rgba8 ? 4 : 8);
  if (isBlock(format)) header.fourCc = format == DdsFormat::Bc1 ? "DXT1" : "DXT5";
  if (format == DdsFormat::Rgba16) header.dxgiFormat = kDxgiRgba16Unorm;
  if (format == DdsFormat::Rgba16Half) header.dxgiFormat = kDxgiRgba16Float;
  return ddsHeaderBytes(header);
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
            format == DdsFormat::Rgba16 ? static_cast<std::uint16_t>(std::lround(held * 65535)) : halfFromFloat(v);
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
      if (std::isnan(v) || (format == DdsFormat::Rgba16Half && std::abs(v) > kMostHalf))
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
