// How textures for GPUs hold texels: the formats, and images to bytes and back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/base/math.h"
#include "scene/image.h"

namespace lumel {

enum class TexelFormat {
  Half,        // RGBA of half floats, 64 bits; alpha 1
  Rgb9e5,      // 32 bits, not negative
  Bc6h,        // blocks of 4 x 4 texels, 8 bits each, not negative
  Bc6hSigned,  // the same with a sign
};

struct TexelFormatTraits {
  const char* name;
  int vkFormat;    // VkFormat, as KTX2 files state it
  int dxgiFormat;  // DXGI_FORMAT, as DDS files state it
  int blockSide;   // texels
  std::size_t blockBytes;
};
const TexelFormatTraits& traitsOf(TexelFormat format);

/// Bytes of an image: whole blocks, rows from the top.
std::size_t byteCount(TexelFormat format, int width, int height);

/// Whether the format holds the image's values: "a negative value, -0.2", "70000, beyond 65504"; nothing where it does.
/// Values below 0 of at most `kTinyNegative` of the image's largest count as 0: denoising may leave them.
inline constexpr float kTinyNegative = 1e-4f;
std::optional<std::string> whyUnfit(TexelFormat format, const Image& rgb);

/// Bytes of an RGB image that the format holds. `weights`: how much the error of a texel counts where texels share a
/// block, row by row; empty: all alike. Blocks that reach over the rim repeat its texels.
std::vector<std::uint8_t> encodeTexels(TexelFormat format, const Image& rgb, std::span<const float> weights = {});

/// The image that a reader of these bytes sees: RGB.
Image decodeTexels(TexelFormat format, std::span<const std::uint8_t> bytes, int width, int height);

}  // namespace lumel
