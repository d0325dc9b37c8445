// The sample patterns of a wave of texels, drawn for all lanes at once.
#pragma once

#include <array>
#include <cstdint>

#include "baker/rays/lanes.h"
#include "scene/base/sobol.h"

namespace lumel {

struct UnitLanes {
  alignas(64) float u[kLanes];
};

struct UnitSquareLanes {
  alignas(64) float x[kLanes];
  alignas(64) float y[kLanes];

  Vec2 operator[](int lane) const { return {x[lane], y[lane]}; }
};

/// Gives each lane the numbers that TexelSampler::get1D and get2D give for its texel and its sample index.
class SampleLanes {
 public:
  void setTexel(int lane, const TexelSampler& sampler) { seeds_[lane] = sampler.seed(); }
  /// Gives each lane the sampler TexelSampler(keys[lane], depths[lane], 0, 0).
  void setTexels(const std::uint32_t* keys, const std::uint32_t* depths);
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

}  // namespace lumel
