// The sample patterns of a wave of texels, drawn for all lanes at once, and the order in which a wave takes them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "baker/sobol.h"

namespace lumel {

/// Texels that advance in step: one lane each, one packet per ray call.
inline constexpr int kLanes = 16;

struct UnitLanes {
  alignas(64) float u[kLanes];
};

struct UnitSquareLanes {
  alignas(64) float x[kLanes];
  alignas(64) float y[kLanes];

  Vec2 operator[](int lane) const { return {x[lane], y[lane]}; }
};

/// Gives each lane what TexelSampler::get1D and get2D give for its texel and its sample index.
class SampleLanes {
 public:
  void setTexel(int lane, const TexelSampler& sampler) { seeds_[lane] = sampler.seed(); }
  void setSample(int lane, std::uint32_t index) { samples_[lane] = index; }
  void setSampleOfAll(std::uint32_t index) {
    for (std::uint32_t& s : samples_) s = index;
  }
  std::uint32_t sample(int lane) const { return samples_[lane]; }

  UnitLanes draw1D(std::uint32_t pattern) const;
  UnitSquareLanes draw2D(std::uint32_t pattern) const;

 private:
  alignas(64) std::uint32_t seeds_[kLanes] = {};
  alignas(64) std::uint32_t samples_[kLanes] = {};
};

/// The order in which the lanes take their samples: at every step all lanes take a point of `pattern` from the same
/// cell of the unit square, cells in Morton order, so that the rays of a packet run close together and yet are
/// independent. Each lane takes every sample of a block exactly once. With 4^k samples in a block a (0, 2k, 2)-net has
/// exactly one point in each of 4^k cells.
class StratumOrder {
 public:
  /// Orders samples [first, first + count), count <= kBlock.
  void arrange(SampleLanes lanes, std::uint32_t pattern, std::uint32_t first, std::uint32_t count);
  std::uint32_t sample(std::uint32_t step, int lane) const {
    return first_ + order_[step * kLanes + static_cast<std::uint32_t>(lane)];
  }

  static constexpr std::uint32_t kBlock = 1024;

 private:
  std::uint32_t first_ = 0;
  std::vector<std::uint16_t> order_;  // [step][lane]
  std::vector<std::uint16_t> cells_;  // [sample][lane]
};

}  // namespace lumel
