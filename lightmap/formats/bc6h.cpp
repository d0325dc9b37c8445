#include "lightmap/formats/bc6h.h"

#include <cstdlib>

#include "scene/base/half.h"

namespace lumel::bc6h {
namespace {

/// Bits of a block, lowest first.
struct BitStream {
  std::uint8_t* bytes;
  std::size_t at = 0;

  void put(unsigned value, int count) {
    for (int i = 0; i < count; ++i, ++at)
      if (value >> i & 1u) bytes[at / 8] = static_cast<std::uint8_t>(bytes[at / 8] | 1u << at % 8);
  }
};
struct BitReader {
  std::span<const std::uint8_t, kBlockBytes> bytes;
  std::size_t at = 0;

  unsigned take(int count) {
    unsigned value = 0;
    for (int i = 0; i < count; ++i, ++at) value |= (bytes[at / 8] >> at % 8 & 1u) << i;
    return value;
  }
};

int signExtended(int value, int bits) {
  const int sign = 1 << (bits - 1);
  return ((value & ((1 << bits) - 1)) ^ sign) - sign;
}

int indexBits(const Mode& mode, std::size_t partitionIndex, std::size_t texel) {
  const bool isAnchor = texel == 0 || (mode.regions == 2 && texel == static_cast<std::size_t>(anchor(partitionIndex)));
  return (mode.regions == 1 ? 4 : 3) - (isAnchor ? 1 : 0);
}

int pointCount(const Mode& mode) { return 2 * mode.regions; }

}  // namespace

bool fits(const Mode& mode, const std::array<int, 4>& ends, std::size_t channel) {
  if (!mode.areDeltas) return true;
  const int reach = 1 << (mode.deltaBits[channel] - 1);
  for (int point = 1; point < pointCount(mode); ++point) {
    const int delta = ends[static_cast<std::size_t>(point)] - ends[0];
    if (delta < -reach || delta >= reach) return false;
  }
  return true;
}

Block pack(const Parts& parts) {
  const Mode& m = mode(parts.mode);
  std::array<std::array<unsigned, 4>, 3> fields{};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t point = 0; point < 4; ++point)
      fields[c][point] =
          static_cast<unsigned>(parts.ends[c][point] - (m.areDeltas && point > 0 ? parts.ends[c][0] : 0));
  Block block{};
  BitStream stream{block.data()};
  stream.put(static_cast<unsigned>(m.prefix), m.prefixBits);
  for (const EndpointBit& bit : m.bits) stream.put(fields[bit.channel][bit.point] >> bit.bit & 1u, 1);
  if (m.regions == 2) stream.put(static_cast<unsigned>(parts.partition), 5);
  for (std::size_t i = 0; i < kTexels; ++i) stream.put(parts.indices[i], indexBits(m, parts.partition, i));
  return block;
}

bool unpack(std::span<const std::uint8_t, kBlockBytes> block, bool isSigned, Parts& parts) {
  parts = {};
  while (parts.mode < kModes &&
         static_cast<int>(block[0] & ((1 << mode(parts.mode).prefixBits) - 1)) != mode(parts.mode).prefix)
    ++parts.mode;
  if (parts.mode == kModes) return false;
  const Mode& m = mode(parts.mode);
  BitReader reader{block, static_cast<std::size_t>(m.prefixBits)};
  for (const EndpointBit& bit : m.bits)
    parts.ends[bit.channel][bit.point] |= static_cast<int>(reader.take(1) << bit.bit);
  if (m.regions == 2) parts.partition = reader.take(5);
  for (std::size_t i = 0; i < kTexels; ++i)
    parts.indices[i] = static_cast<std::uint8_t>(reader.take(indexBits(m, parts.partition, i)));
  for (std::size_t c = 0; c < 3; ++c) {
    std::array<int, 4>& ends = parts.ends[c];
    if (isSigned) ends[0] = signExtended(ends[0], m.precision);
    for (std::size_t point = 1; point < static_cast<std::size_t>(pointCount(m)); ++point) {
      if (m.areDeltas) {
        ends[point] = (ends[0] + signExtended(ends[point], m.deltaBits[c])) & ((1 << m.precision) - 1);
      }
      if (isSigned) ends[point] = signExtended(ends[point], m.precision);
    }
  }
  return true;
}

int unquantized(int value, int precision, bool isSigned) {
  if (!isSigned) {
    if (precision >= 15 || value == 0) return value;
    return value == (1 << precision) - 1 ? 0xffff : ((value << 16) + 0x8000) >> precision;
  }
  if (precision >= 16 || value == 0) return value;
  const int size = std::abs(value);
  const int result = size >= (1 << (precision - 1)) - 1 ? 0x7fff : ((size << 15) + 0x4000) >> (precision - 1);
  return value < 0 ? -result : result;
}

std::uint16_t halfBits(int interpolated, bool isSigned) {
  if (!isSigned) return static_cast<std::uint16_t>(interpolated * 31 >> 6);
  const int size = std::abs(interpolated) * 31 >> 5;
  return static_cast<std::uint16_t>(interpolated < 0 ? 0x8000 | size : size);
}

std::array<Vec3, kTexels> decode(std::span<const std::uint8_t, kBlockBytes> block, bool isSigned) {
  std::array<Vec3, kTexels> colors{};
  Parts parts;
  if (!unpack(block, isSigned, parts)) return colors;
  const Mode& m = mode(parts.mode);
  for (std::size_t i = 0; i < kTexels; ++i) {
    const std::size_t region = m.regions == 2 && (partition(parts.partition) >> i & 1) ? 1 : 0;
    const int weight = weights(m.regions)[parts.indices[i]];
    for (std::size_t c = 0; c < 3; ++c) {
      const int a = unquantized(parts.ends[c][2 * region], m.precision, isSigned);
      const int b = unquantized(parts.ends[c][2 * region + 1], m.precision, isSigned);
      colors[i][static_cast<int>(c)] = floatFromHalf(halfBits((a * (64 - weight) + b * weight + 32) >> 6, isSigned));
    }
  }
  return colors;
}

}  // namespace lumel::bc6h
