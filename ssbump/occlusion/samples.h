// Directions over the hemisphere above the base surface, uniform in solid angle, from numbers that depend only on the
// texel and the sample: results do not depend on threads or tiles.
#pragma once

#include <cstdint>

#include "scene/base/math.h"

namespace lumel::ssbump {

enum class RaySampling {
  Random,      // independent
  Stratified,  // one jittered direction in each cell of a grid over the hemisphere; same cell for the same index
  Sobol,       // Owen-scrambled (0,2)-sequence, scrambled per texel
};

class HemisphereSamples {
 public:
  HemisphereSamples(RaySampling sampling, int count, std::uint32_t seed);

  /// Sample `index` of [0, count) for the texel with this key. pdf = 1 / (2 pi).
  Vec3 direction(std::uint64_t texelKey, int index) const;

 private:
  RaySampling sampling_;
  int count_, columns_;
  std::uint32_t seed_;
};

}  // namespace lumel::ssbump
