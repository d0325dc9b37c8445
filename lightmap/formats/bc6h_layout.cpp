#include "lightmap/formats/bc6h_layout.h"

#include <string_view>
#include <vector>

namespace lumel::bc6h {
namespace {

/// One mode as text. `layout`: words CP or CPn or CPn-m, with channel C, point P and the first and last bit of a run.
struct ModeText {
  int prefix, prefixBits, regions, precision;
  std::array<int, 3> deltaBits;
  bool areDeltas;
  std::string_view layout;
};

constexpr ModeText kTexts[kModes] = {
    {0x00,
     2,
     2,
     10,
     {5, 5, 5},
     true,
     "gy4 by4 bz4 rw0-9 gw0-9 bw0-9 rx0-4 gz4 gy0-3 gx0-4 bz0 gz0-3 bx0-4 bz1 by0-3 ry0-4 bz2 rz0-4 bz3"},
    {0x01,
     2,
     2,
     7,
     {6, 6, 6},
     true,
     "gy5 gz4 gz5 rw0-6 bz0 bz1 by4 gw0-6 by5 bz2 gy4 bw0-6 bz3 bz5 bz4 rx0-5 gy0-3 gx0-5 gz0-3 bx0-5 by0-3 ry0-5 "
     "rz0-5"},
    {0x02,
     5,
     2,
     11,
     {5, 4, 4},
     true,
     "rw0-9 gw0-9 bw0-9 rx0-4 rw10 gy0-3 gx0-3 gw10 bz0 gz0-3 bx0-3 bw10 bz1 by0-3 ry0-4 bz2 rz0-4 bz3"},
    {0x06,
     5,
     2,
     11,
     {4, 5, 4},
     true,
     "rw0-9 gw0-9 bw0-9 rx0-3 rw10 gz4 gy0-3 gx0-4 gw10 gz0-3 bx0-3 bw10 bz1 by0-3 ry0-3 bz0 bz2 rz0-3 gy4 bz3"},
    {0x0a,
     5,
     2,
     11,
     {4, 4, 5},
     true,
     "rw0-9 gw0-9 bw0-9 rx0-3 rw10 by4 gy0-3 gx0-3 gw10 bz0 gz0-3 bx0-4 bw10 by0-3 ry0-3 bz1 bz2 rz0-3 bz4 bz3"},
    {0x0e,
     5,
     2,
     9,
     {5, 5, 5},
     true,
     "rw0-8 by4 gw0-8 gy4 bw0-8 bz4 rx0-4 gz4 gy0-3 gx0-4 bz0 gz0-3 bx0-4 bz1 by0-3 ry0-4 bz2 rz0-4 bz3"},
    {0x12,
     5,
     2,
     8,
     {6, 5, 5},
     true,
     "rw0-7 gz4 by4 gw0-7 bz2 gy4 bw0-7 bz3 bz4 rx0-5 gy0-3 gx0-4 bz0 gz0-3 bx0-4 bz1 by0-3 ry0-5 rz0-5"},
    {0x16,
     5,
     2,
     8,
     {5, 6, 5},
     true,
     "rw0-7 bz0 by4 gw0-7 gy5 gy4 bw0-7 gz5 bz4 rx0-4 gz4 gy0-3 gx0-5 gz0-3 bx0-4 bz1 by0-3 ry0-4 bz2 rz0-4 bz3"},
    {0x1a,
     5,
     2,
     8,
     {5, 5, 6},
     true,
     "rw0-7 bz1 by4 gw0-7 by5 gy4 bw0-7 bz5 bz4 rx0-4 gz4 gy0-3 gx0-4 bz0 gz0-3 bx0-5 by0-3 ry0-4 bz2 rz0-4 bz3"},
    {0x1e,
     5,
     2,
     6,
     {6, 6, 6},
     false,
     "rw0-5 gz4 bz0 bz1 by4 gw0-5 gy5 by5 bz2 gy4 bw0-5 gz5 bz3 bz5 bz4 rx0-5 gy0-3 gx0-5 gz0-3 bx0-5 by0-3 ry0-5 "
     "rz0-5"},
    {0x03, 5, 1, 10, {10, 10, 10}, false, "rw0-9 gw0-9 bw0-9 rx0-9 gx0-9 bx0-9"},
    {0x07, 5, 1, 11, {9, 9, 9}, true, "rw0-9 gw0-9 bw0-9 rx0-8 rw10 gx0-8 gw10 bx0-8 bw10"},
    {0x0b, 5, 1, 12, {8, 8, 8}, true, "rw0-9 gw0-9 bw0-9 rx0-7 rw11-10 gx0-7 gw11-10 bx0-7 bw11-10"},
    {0x0f, 5, 1, 16, {4, 4, 4}, true, "rw0-9 gw0-9 bw0-9 rx0-3 rw15-10 gx0-3 gw15-10 bx0-3 bw15-10"}};

std::vector<EndpointBit> parse(std::string_view layout) {
  std::vector<EndpointBit> bits;
  for (std::size_t at = 0; at < layout.size(); ++at) {  // the loop's own step skips the space
    const auto channel = static_cast<std::uint8_t>(std::string_view("rgb").find(layout[at++]));
    const auto point = static_cast<std::uint8_t>(std::string_view("wxyz").find(layout[at++]));
    const auto number = [&] {
      int value = 0;
      while (at < layout.size() && layout[at] >= '0' && layout[at] <= '9') value = 10 * value + (layout[at++] - '0');
      return value;
    };
    const int first = number();
    const int last = at < layout.size() && layout[at] == '-' ? (++at, number()) : first;
    for (int bit = first;; bit += first < last ? 1 : -1) {
      bits.push_back({channel, point, static_cast<std::uint8_t>(bit)});
      if (bit == last) break;
    }
  }
  return bits;
}

struct Modes {
  std::array<std::vector<EndpointBit>, kModes> bits;
  std::array<Mode, kModes> modes;
  Modes() {
    for (std::size_t i = 0; i < kModes; ++i) {
      const ModeText& text = kTexts[i];
      bits[i] = parse(text.layout);
      modes[i] = {text.prefix, text.prefixBits, text.regions, text.precision, text.deltaBits, text.areDeltas, bits[i]};
    }
  }
};

/// Rows of a block from the top, four texels a digit; the leftmost texel of a row is its lowest bit.
constexpr std::uint16_t rows(unsigned a, unsigned b, unsigned c, unsigned d) {
  return static_cast<std::uint16_t>(a | b << 4 | c << 8 | d << 12);
}

constexpr std::uint16_t kPartitionMasks[kPartitions] = {
    rows(0xc, 0xc, 0xc, 0xc), rows(0x8, 0x8, 0x8, 0x8), rows(0xe, 0xe, 0xe, 0xe), rows(0x8, 0xc, 0xc, 0xe),
    rows(0x0, 0x8, 0x8, 0xc), rows(0xc, 0xe, 0xe, 0xf), rows(0x8, 0xc, 0xe, 0xf), rows(0x0, 0x8, 0xc, 0xe),
    rows(0x0, 0x0, 0x8, 0xc), rows(0xc, 0xe, 0xf, 0xf), rows(0x0, 0x8, 0xe, 0xf), rows(0x0, 0x0, 0x8, 0xe),
    rows(0x8, 0xe, 0xf, 0xf), rows(0x0, 0x0, 0xf, 0xf), rows(0x0, 0xf, 0xf, 0xf), rows(0x0, 0x0, 0x0, 0xf),
    rows(0x0, 0x1, 0x7, 0xf), rows(0xe, 0x8, 0x0, 0x0), rows(0x0, 0x0, 0x1, 0x7), rows(0xe, 0xc, 0x8, 0x0),
    rows(0xc, 0x8, 0x0, 0x0), rows(0x0, 0x1, 0x3, 0x7), rows(0x0, 0x0, 0x1, 0x3), rows(0xe, 0xc, 0xc, 0x8),
    rows(0xc, 0x8, 0x8, 0x0), rows(0x0, 0x1, 0x1, 0x3), rows(0x6, 0x6, 0x6, 0x6), rows(0xc, 0x6, 0x6, 0x3),
    rows(0x8, 0xe, 0x7, 0x1), rows(0x0, 0xf, 0xf, 0x0), rows(0xe, 0x8, 0x1, 0x7), rows(0xc, 0x9, 0x9, 0x3)};

constexpr std::array<std::uint8_t, kPartitions> kAnchors = {
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 2, 8, 2, 2, 8, 8, 15, 2, 8, 2, 2, 8, 8, 2, 2};

constexpr int kWeights3[8] = {0, 9, 18, 27, 37, 46, 55, 64};
constexpr int kWeights4[16] = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

}  // namespace

const Mode& mode(std::size_t index) {
  static const Modes table;
  return table.modes[index];
}

std::uint16_t partition(std::size_t index) { return kPartitionMasks[index]; }

int anchor(std::size_t partition) { return kAnchors[partition]; }

std::span<const int> weights(int regions) {
  return regions == 1 ? std::span<const int>(kWeights4) : std::span<const int>(kWeights3);
}

}  // namespace lumel::bc6h
