// Sobol points in the order of the cells that they fall into, so that neighbouring texels can send rays into the same
// cell of their hemispheres at the same time: packets stay coherent while every texel keeps its own low-discrepancy
// sequence.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "baker/sobol.h"

namespace lumel {

/// Most points of one net: 16 x 16 cells.
inline constexpr int kMostNetPoints = 256;

/// An aligned stretch of a sequence: 2^log2Count samples from `first`, a multiple of their number.
struct NetRange {
  std::uint32_t first = 0;
  int log2Count = 0;
  std::uint32_t count() const { return std::uint32_t{1} << log2Count; }
};

/// The largest net that starts at `first` and does not go past `end`. Precondition: first < end.
inline NetRange netAt(std::uint32_t first, std::uint32_t end) {
  int log2Count = std::bit_width(std::min<std::uint32_t>(end - first, kMostNetPoints)) - 1;
  if (first != 0) log2Count = std::min(log2Count, std::countr_zero(first));
  return {first, log2Count};
}

/// Interleaved bits: x in the even places, y in the odd ones.
inline std::uint32_t mortonCode(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 4)) & 0x0f0fu;
    v = (v | (v << 2)) & 0x3333u;
    return (v | (v << 1)) & 0x5555u;
  };
  return spread(x) | (spread(y) << 1);
}

/// One texel's points of a net by cell. An aligned block of 2^m points of a (0, 2)-sequence is a (0, m, 2)-net: each
/// of 2^ceil(m/2) x 2^floor(m/2) cells holds exactly one of them (Niederreiter 1987; Owen scrambling keeps this).
struct NetByCell {
  std::array<Vec2, kMostNetPoints> points;
  std::array<std::uint32_t, kMostNetPoints> samples;  // index in the sequence

  void fill(const TexelSampler& sampler, const NetRange& net, std::uint32_t pattern) {
    const int bitsX = (net.log2Count + 1) / 2;
    const int bitsY = net.log2Count / 2;
    const auto cellsX = static_cast<float>(1 << bitsX);
    const auto cellsY = static_cast<float>(1 << bitsY);
    for (std::uint32_t i = 0; i < net.count(); ++i) {
      const Vec2 u = sampler.get2D(net.first + i, pattern);
      const std::uint32_t cell =
          mortonCode(static_cast<std::uint32_t>(u.x * cellsX), static_cast<std::uint32_t>(u.y * cellsY));
      points[cell] = u;
      samples[cell] = net.first + i;
    }
  }
};

}  // namespace lumel
