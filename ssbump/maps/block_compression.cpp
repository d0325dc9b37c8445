#include "ssbump/maps/block_compression.h"

#include <squish.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel::ssbump {
namespace {

using Block = std::array<std::uint8_t, 64>;  // 4x4 RGBA

constexpr int kColour = squish::kColourIterativeClusterFit;

bool isColour(BlockFormat format) { return format == BlockFormat::Bc1 || format == BlockFormat::Bc3; }
int colourFlags(BlockFormat format) { return (format == BlockFormat::Bc1 ? squish::kDxt1 : squish::kDxt5) | kColour; }

/// libsquish 1.15 names BC4 and BC5 but writes DXT1 for them. A BC4 block is what a DXT5 block begins with: its alpha.
void compressChannel(const Block& texels, std::size_t channel, std::uint8_t* out) {
  Block asAlpha{};
  for (std::size_t i = 0; i < 16; ++i) asAlpha[i * 4 + 3] = texels[i * 4 + channel];
  std::array<std::uint8_t, 16> block{};
  squish::Compress(asAlpha.data(), block.data(), squish::kDxt5 | squish::kColourRangeFit);
  std::copy_n(block.begin(), 8, out);
}

void decompressChannel(const std::uint8_t* in, std::size_t channel, Block& texels) {
  std::array<std::uint8_t, 16> block{};
  std::copy_n(in, 8, block.begin());
  Block asAlpha{};
  squish::Decompress(asAlpha.data(), block.data(), squish::kDxt5);
  for (std::size_t i = 0; i < 16; ++i) texels[i * 4 + channel] = asAlpha[i * 4 + 3];
}

void compressBlock(const Block& texels, BlockFormat format, std::uint8_t* out) {
  // The channels are weights that count alike: no perceptual metric.
  std::array<float, 3> metric{1, 1, 1};
  if (isColour(format)) return squish::Compress(texels.data(), out, colourFlags(format), metric.data());
  compressChannel(texels, 0, out);
  if (format == BlockFormat::Bc5) compressChannel(texels, 1, out + 8);
}

Block decompressBlock(const std::uint8_t* in, BlockFormat format) {
  Block texels{};
  if (isColour(format)) {
    squish::Decompress(texels.data(), in, colourFlags(format));
    return texels;
  }
  for (std::size_t i = 0; i < 16; ++i) texels[i * 4 + 3] = 255;
  decompressChannel(in, 0, texels);
  if (format == BlockFormat::Bc5) decompressChannel(in + 8, 1, texels);
  return texels;
}

std::uint8_t toByte(float v) { return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255.0f)); }

Block fetchBlock(const Image& image, int bx, int by) {
  Block block{};
  for (int i = 0; i < 16; ++i) {
    const float* p = image.at(std::min(bx * 4 + i % 4, image.width - 1), std::min(by * 4 + i / 4, image.height - 1));
    for (int c = 0; c < 4; ++c) {
      const float v = c < image.channels ? p[c] : c == 3 ? 1.0f : image.channels == 1 ? p[0] : 0.0f;
      block[static_cast<std::size_t>(i * 4 + c)] = toByte(v);
    }
  }
  return block;
}

}  // namespace

std::size_t blockBytes(BlockFormat format) { return format == BlockFormat::Bc1 || format == BlockFormat::Bc4 ? 8 : 16; }

std::vector<std::uint8_t> compressBlocks(const Image& image, BlockFormat format, const Progress& progress) {
  const auto across = static_cast<std::size_t>((image.width + 3) / 4),
             down = static_cast<std::size_t>((image.height + 3) / 4);
  const std::size_t bytes = blockBytes(format);
  std::vector<std::uint8_t> blocks(across * down * bytes);
  parallelFor(down, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t by = first; by < last && !progress.cancelled(); ++by)
      for (std::size_t bx = 0; bx < across; ++bx)
        compressBlock(fetchBlock(image, static_cast<int>(bx), static_cast<int>(by)), format,
                      &blocks[(by * across + bx) * bytes]);
  });
  return blocks;
}

Image decompressBlocks(std::span<const std::uint8_t> blocks, int width, int height, BlockFormat format) {
  const auto across = static_cast<std::size_t>((width + 3) / 4), down = static_cast<std::size_t>((height + 3) / 4);
  const std::size_t bytes = blockBytes(format);
  LUMEL_CHECK(blocks.size() == across * down * bytes);
  Image image(width, height, 4);
  parallelFor(down, 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t by = first; by < last; ++by)
      for (std::size_t bx = 0; bx < across; ++bx) {
        const Block texels = decompressBlock(&blocks[(by * across + bx) * bytes], format);
        for (int i = 0; i < 16; ++i) {
          const int x = static_cast<int>(bx) * 4 + i % 4, y = static_cast<int>(by) * 4 + i / 4;
          if (x >= width || y >= height) continue;
          for (int c = 0; c < 4; ++c)
            image.at(x, y)[c] = static_cast<float>(texels[static_cast<std::size_t>(i * 4 + c)]) / 255.0f;
        }
      }
  });
  return image;
}

}  // namespace lumel::ssbump
