#include "baker/light/learnt_choice.h"

#include <cmath>

namespace lumel {

void LearntChoice::learn() {
  for (std::size_t g = 0; g < factors_.size(); ++g) {
    if (!(expected_[g] > 0.0)) continue;
    factors_[g] = static_cast<float>(std::sqrt(arrived_[g] / expected_[g]));
    hasLearnt_ = true;
  }
}

}  // namespace lumel
