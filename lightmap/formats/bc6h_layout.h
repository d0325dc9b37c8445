// BC6H blocks as the Khronos Data Format Specification (chapter "BPTC Compressed Texture Image Formats") and Direct3D's
// documentation of BC6H describe them: 14 modes, 32 ways to share 16 texels between two regions, where each bit of the
// end points lies.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace lumel::bc6h {

inline constexpr std::size_t kModes = 14;
inline constexpr std::size_t kPartitions = 32;
inline constexpr std::size_t kTexels = 16;

/// A bit of an end point: of its channel (0 red to 2 blue) and point (w, x, y, z: the ends of the first region, then of
/// the second).
struct EndpointBit {
  std::uint8_t channel = 0;
  std::uint8_t point = 0;
  std::uint8_t bit = 0;
};

struct Mode {
  int prefix = 0;                     // the mode's number as the block states it
  int prefixBits = 0;                 // 2 or 5
  int regions = 1;                    // 1: 4 bits an index; 2: 3 bits and a partition
  int precision = 0;                  // bits of w
  std::array<int, 3> deltaBits{};     // of x, y and z in each channel
  bool areDeltas = false;             // whether x, y and z are differences to w
  std::span<const EndpointBit> bits;  // in their order in the block, after the prefix
};

const Mode& mode(std::size_t index);

/// Bit i is set where texel i (row by row) of a block belongs to the second region.
std::uint16_t partition(std::size_t index);
/// The texel whose index lacks its highest bit, which is 0, in the second region; in the first it is texel 0.
int anchor(std::size_t partition);

/// Share of the second end point in 64ths: 8 or 16 of them.
std::span<const int> weights(int regions);

}  // namespace lumel::bc6h
