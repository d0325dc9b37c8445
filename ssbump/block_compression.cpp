#include "ssbump/block_compression.h"

#include <squish.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel::ssbump {
namespace {

using Block = std::array<std::uint8_t, 64>;  // 4x4 RGBA

int squishFlags(BlockFormat format) {
  switch (format) {
    case BlockFormat::Bc1:
      return squish::kDxt1 | squish::kColourIterativeClusterFit;
    case BlockFormat::Bc3:
      return squish::kDxt5 | squish::kColourIterativeClusterFit;
    case BlockFormat::Bc4:
      return squish::kBc4;
    case BlockFormat::Bc5:
      return squish::kBc5;
  }
  return 0;
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

std::size_t blockBytes(BlockFormat format) {
  return format == BlockFormat::Bc1 || format == BlockFormat::Bc4 ? 8 : 16;
}

std::vector<std::uint8_t> compressBlocks(const Image& image, BlockFormat format) {
  const auto across = static_cast<std::size_t>((image.width + 3) / 4), down = static_cast<std::size_t>((image.height + 3) / 4);
  const std::size_t bytes = blockBytes(format);
  const int flags = squishFlags(format);
  std::vector<std::uint8_t> blocks(across * down * bytes);
  // The channels are weights that count alike: no perceptual metric.
  std::array<float, 3> metric{1, 1, 1};
  parallelFor(down, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t by = first; by < last; ++by)
      for (std::size_t bx = 0; bx < across; ++bx) {
        const Block texels = fetchBlock(image, static_cast<int>(bx), static_cast<int>(by));
        squish::Compress(texels.data(), &blocks[(by * across + bx) * bytes], flags, metric.data());
      }
  });
  return blocks;
}

Image decompressBlocks(std::span<const std::uint8_t> blocks, int width, int height, BlockFormat format) {
  const auto across = static_cast<std::size_t>((width + 3) / 4), down = static_cast<std::size_t>((height + 3) / 4);
  const std::size_t bytes = blockBytes(format);
  LUMEL_CHECK(blocks.size() == across * down * bytes);
  const int flags = squishFlags(format);
  Image image(width, height, 4);
  parallelFor(down, 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t by = first; by < last; ++by)
      for (std::size_t bx = 0; bx < across; ++bx) {
        Block texels{};
        squish::Decompress(texels.data(), &blocks[(by * across + bx) * bytes], flags);
        for (int i = 0; i < 16; ++i) {
          const int x = static_cast<int>(bx) * 4 + i % 4, y = static_cast<int>(by) * 4 + i / 4;
          if (x >= width || y >= height) continue;
          for (int c = 0; c < 4; ++c) image.at(x, y)[c] = static_cast<float>(texels[static_cast<std::size_t>(i * 4 + c)]) / 255.0f;
        }
      }
  });
  return image;
}

}  // namespace lumel::ssbump
