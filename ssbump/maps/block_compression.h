// The one door to libsquish: 4x4 block compression, and back for the compression study.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/image.h"

namespace lumel::ssbump {

enum class BlockFormat {
  Bc1,  // DXT1: RGB in 4 bits per texel
  Bc3,  // DXT5: RGB as BC1, alpha as BC4; 8 bits
  Bc4,  // one channel, 4 bits
  Bc5,  // two channels, 8 bits
};

/// Bytes of one 4x4 block.
std::size_t blockBytes(BlockFormat format);

/// Blocks row by row; partial blocks at the right and lower edge repeat the last texel. Values are clamped to 0..1.
/// Missing channels read as grey (one channel) or alpha 1. Once `progress` is cancelled the rest is left out: ask it.
std::vector<std::uint8_t> compressBlocks(const Image& image, BlockFormat format,
                                         const Progress& progress = noProgress());

/// The texels that the blocks stand for: RGBA; Bc4 in R, Bc5 in R and G.
Image decompressBlocks(std::span<const std::uint8_t> blocks, int width, int height, BlockFormat format);

}  // namespace lumel::ssbump
