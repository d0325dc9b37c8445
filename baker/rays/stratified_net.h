// Sobol points in the order of the cells that they fall into, so that neighbouring texels can send rays into the same
// cell of their hemispheres at the same time: packets stay coherent while every texel keeps its own low-discrepancy
// sequence.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "baker/rays/lanes.h"
#include "scene/base/sobol.h"

namespace lumel {

/// The most points that one net has: 32 x 32 cells.
inline constexpr std::uint32_t kMostNetPoints = 1024;

/// An aligned stretch of a sequence. It has 2^log2Count samples from `first` on, which is a multiple of their number.
struct NetRange {
  std::uint32_t first = 0;
  int log2Count = 0;
  std::uint32_t count() const { return std::uint32_t{1} << log2Count; }
};

/// Returns the largest net that starts at `first` and does not go past `end`. Precondition: first < end.
inline NetRange netAt(std::uint32_t first, std::uint32_t end) {
  int log2Count = std::bit_width(std::min(end - first, kMostNetPoints)) - 1;
  if (first != 0) log2Count = std::min(log2Count, std::countr_zero(first));
  return {first, log2Count};
}

/// The place of a cell among 2^ceil(m/2) x 2^floor(m/2), where m is the net's log2Count.
struct NetCell {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
};
NetCell netCell(std::uint32_t cell);

/// The points of a net by cell, for every lane of a wave. An aligned block of 2^m points of a (0, 2)-sequence is a
/// (0, m, 2)-net: each of 2^ceil(m/2) x 2^floor(m/2) cells holds exactly one of them (Niederreiter 1987; Owen
/// scrambling keeps this). Cells are in Morton order, so that one packet's rays are close to those of the next.
class NetLanes {
 public:
  /// Draws the points of `pattern`. Lanes that are not `active` hold zeros.
  void fill(const std::array<TexelSampler, kLanes>& samplers, const std::array<bool, kLanes>& active,
            const NetRange& net, std::uint32_t pattern);

  /// Return kLanes values each: the lanes' points in a cell.
  const float* x(std::uint32_t cell) const { return x_.data() + std::size_t{cell} * kLanes; }
  const float* y(std::uint32_t cell) const { return y_.data() + std::size_t{cell} * kLanes; }
  /// Returns a lane's index in the sequence for a cell.
  std::uint32_t sample(std::uint32_t cell, std::size_t lane) const {
    return net_.first + offset_[cell * kLanes + lane];
  }
  const NetRange& net() const { return net_; }

 private:
  NetRange net_;
  // [cell][lane]; only what the net at hand needs is ever touched
  alignas(64) std::array<float, std::size_t{kMostNetPoints} * kLanes> x_;
  alignas(64) std::array<float, std::size_t{kMostNetPoints} * kLanes> y_;
  std::array<std::uint16_t, std::size_t{kMostNetPoints} * kLanes> offset_;
};

}  // namespace lumel
