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

/// One texel's points of a net by cell. An aligned block of 2^m points of a (0, 2)-sequence is a (0, m, 2)-net: each
/// of 2^ceil(m/2) x 2^floor(m/2) cells holds exactly one of them (Niederreiter 1987; Owen scrambling keeps this).
struct NetByCell {
  std::array<Vec2, kMostNetPoints> points;
  std::array<std::uint32_t, kMostNetPoints> samples;  // index in the sequence

  void fill(const TexelSampler& sampler, const NetRange& net, std::uint32_t pattern);
};

}  // namespace lumel
