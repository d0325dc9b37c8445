// BC6H: 4 x 4 texels of three half floats in 16 bytes, 8 bits a texel.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lightmap/formats/bc6h_layout.h"
#include "scene/base/math.h"

namespace lumel::bc6h {

inline constexpr std::size_t kBlockBytes = 16;
using Block = std::array<std::uint8_t, kBlockBytes>;

/// What a block says. End points are in the mode's precision and not yet differences; with signed blocks they are
/// signed.
struct Parts {
  std::size_t mode = 0;
  std::size_t partition = 0;
  std::array<std::array<int, 4>, 3> ends{};  // by channel, then w, x, y, z
  std::array<std::uint8_t, kTexels> indices{};
};

/// Writes a block. The differences to w must fit the mode (`fits`) and the anchors' indices must lack their highest
/// bit.
Block pack(const Parts& parts);
/// Reads one; modes that are reserved give nothing: all texels are zero, as readers must show them.
bool unpack(std::span<const std::uint8_t, kBlockBytes> block, bool isSigned, Parts& parts);

/// Whether the mode holds these end points.
bool fits(const Mode& mode, const std::array<int, 4>& ends, std::size_t channel);

/// An end point in the numbers that are interpolated: 0 to 0xffff, or -0x7fff to 0x7fff.
int unquantized(int value, int precision, bool isSigned);
/// What an interpolated number stands for, as the bits of a half.
std::uint16_t halfBits(int interpolated, bool isSigned);

/// The colours of a block, row by row.
std::array<Vec3, kTexels> decode(std::span<const std::uint8_t, kBlockBytes> block, bool isSigned);

/// A block to be encoded. Values are finite and of at most kMostHalf; without a sign negative ones count as 0.
struct Texels {
  std::array<Vec3, kTexels> colors{};
  std::array<float, kTexels> weights{};  // how much a texel's squared error counts; at least one is > 0
};

/// Encodes by least squares of the linear values: the line through the colours (its principal axis), or two of them for
/// the partitions that leave least beside their lines; indices and end points are then improved in turn, and at last
/// each end point step by step. Deterministic.
Block encode(const Texels& texels, bool isSigned);

}  // namespace lumel::bc6h
