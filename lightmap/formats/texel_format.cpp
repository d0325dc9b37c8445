#include "lightmap/formats/texel_format.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lightmap/formats/bc6h.h"
#include "lightmap/formats/rgb9e5.h"
#include "scene/base/half.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr std::array<TexelFormatTraits, 4> kTraits = {{
    {"half", 97, 10, 1, 8},          // R16G16B16A16_SFLOAT, R16G16B16A16_FLOAT
    {"rgb9e5", 123, 67, 1, 4},       // E5B9G9R9_UFLOAT_PACK32, R9G9B9E5_SHAREDEXP
    {"bc6h", 143, 95, 4, 16},        // BC6H_UFLOAT_BLOCK, BC6H_UF16
    {"bc6h-signed", 144, 96, 4, 16}  // BC6H_SFLOAT_BLOCK, BC6H_SF16
}};

constexpr std::uint16_t kHalfOne = 0x3c00;

void putLittleEndian(std::uint8_t* at, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) at[i] = static_cast<std::uint8_t>(value >> 8 * i);
}
std::uint32_t takeLittleEndian(const std::uint8_t* at, int bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= static_cast<std::uint32_t>(at[i]) << 8 * i;
  return value;
}

bool isSigned(TexelFormat format) { return format == TexelFormat::Half || format == TexelFormat::Bc6hSigned; }
bool isBlocks(TexelFormat format) { return format == TexelFormat::Bc6h || format == TexelFormat::Bc6hSigned; }

void encodeTexel(TexelFormat format, const Vec3& color, std::uint8_t* at) {
  if (format == TexelFormat::Rgb9e5) {
    putLittleEndian(at, rgb9e5FromColor(color), 4);
    return;
  }
  for (int c = 0; c < 3; ++c) putLittleEndian(at + 2 * c, halfFromFloat(color[c]), 2);
  putLittleEndian(at + 6, kHalfOne, 2);
}

Vec3 decodeTexel(TexelFormat format, const std::uint8_t* at) {
  if (format == TexelFormat::Rgb9e5) return colorFromRgb9e5(takeLittleEndian(at, 4));
  Vec3 color;
  for (int c = 0; c < 3; ++c) color[c] = floatFromHalf(static_cast<std::uint16_t>(takeLittleEndian(at + 2 * c, 2)));
  return color;
}

/// The texels of a block; where none of them counts all do.
bc6h::Texels blockOf(const Image& rgb, std::span<const float> weights, int left, int top) {
  bc6h::Texels block;
  float sum = 0.0f;
  for (int i = 0; i < static_cast<int>(bc6h::kTexels); ++i) {
    const int x = std::min(left + i % 4, rgb.width - 1), y = std::min(top + i / 4, rgb.height - 1);
    const auto at = static_cast<std::size_t>(i);
    block.colors[at] = rgb.rgb(x, y);
    const auto texel = static_cast<std::size_t>(y) * static_cast<std::size_t>(rgb.width) + static_cast<std::size_t>(x);
    const bool isInside = left + i % 4 < rgb.width && top + i / 4 < rgb.height;
    block.weights[at] = !isInside ? 0.0f : weights.empty() ? 1.0f : weights[texel];
    sum += block.weights[at];
  }
  if (!(sum > 0.0f)) block.weights.fill(1.0f);
  return block;
}

}  // namespace

const TexelFormatTraits& traitsOf(TexelFormat format) { return kTraits[static_cast<std::size_t>(format)]; }

std::size_t byteCount(TexelFormat format, int width, int height) {
  const TexelFormatTraits& traits = traitsOf(format);
  const auto blocks = [&traits](int texels) {
    return static_cast<std::size_t>((texels + traits.blockSide - 1) / traits.blockSide);
  };
  return blocks(width) * blocks(height) * traits.blockBytes;
}

std::optional<std::string> whyUnfit(TexelFormat format, const Image& rgb) {
  const auto [least, most] = std::minmax_element(rgb.pixels.begin(), rgb.pixels.end());
  if (least == rgb.pixels.end()) return {};
  const float limit = format == TexelFormat::Rgb9e5 ? kMostRgb9e5 : kMostHalf;
  if (!std::all_of(rgb.pixels.begin(), rgb.pixels.end(), [](float v) { return std::isfinite(v); }))
    return "a value that is not finite";
  if (std::max(std::abs(*least), *most) > limit)
    return std::to_string(std::max(std::abs(*least), *most)) + ", beyond " + std::to_string(static_cast<int>(limit));
  if (!isSigned(format) && *least < -kTinyNegative * std::max(*most, 0.0f))
    return "a negative value, " + std::to_string(*least);
  return {};
}

std::vector<std::uint8_t> encodeTexels(TexelFormat format, const Image& rgb, std::span<const float> weights) {
  std::vector<std::uint8_t> bytes(byteCount(format, rgb.width, rgb.height));
  const TexelFormatTraits& traits = traitsOf(format);
  const int columns = (rgb.width + traits.blockSide - 1) / traits.blockSide;
  const int rows = (rgb.height + traits.blockSide - 1) / traits.blockSide;
  parallelFor(static_cast<std::size_t>(rows), 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row)
      for (int column = 0; column < columns; ++column) {
        std::uint8_t* at = bytes.data() + (row * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)) *
                                              traits.blockBytes;
        const int y = static_cast<int>(row);
        if (!isBlocks(format)) {
          encodeTexel(format, rgb.rgb(column, y), at);
          continue;
        }
        const bc6h::Block block =
            bc6h::encode(blockOf(rgb, weights, 4 * column, 4 * y), format == TexelFormat::Bc6hSigned);
        std::copy(block.begin(), block.end(), at);
      }
  });
  return bytes;
}

Image decodeTexels(TexelFormat format, std::span<const std::uint8_t> bytes, int width, int height) {
  Image image(width, height, 3);
  const TexelFormatTraits& traits = traitsOf(format);
  const int columns = (width + traits.blockSide - 1) / traits.blockSide;
  for (std::size_t block = 0; (block + 1) * traits.blockBytes <= bytes.size(); ++block) {
    const int left = static_cast<int>(block) % columns * traits.blockSide;
    const int top = static_cast<int>(block) / columns * traits.blockSide;
    const std::uint8_t* at = bytes.data() + block * traits.blockBytes;
    if (!isBlocks(format)) {
      image.setRgb(left, top, decodeTexel(format, at));
      continue;
    }
    const auto colors = bc6h::decode(std::span<const std::uint8_t, bc6h::kBlockBytes>(at, bc6h::kBlockBytes),
                                     format == TexelFormat::Bc6hSigned);
    for (int i = 0; i < static_cast<int>(bc6h::kTexels); ++i)
      if (left + i % 4 < width && top + i / 4 < height)
        image.setRgb(left + i % 4, top + i / 4, colors[static_cast<std::size_t>(i)]);
  }
  return image;
}

}  // namespace lumel
