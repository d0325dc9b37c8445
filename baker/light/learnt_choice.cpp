#include "baker/light/learnt_choice.h"

#include <algorithm>
#include <cmath>

namespace lumel {

void LearntChoice::learn() {
  for (std::size_t g = 0; g < factors_.size(); ++g) {
    if (!(seen_[g] > 0.0)) continue;
    factors_[g] = static_cast<float>(std::sqrt(std::clamp(arrived_[g] / seen_[g], 0.0, 1.0)));
    evenShares_[g] = kEven * (1.0f - factors_[g]);
  }
}

}  // namespace lumel
