// How a wave chooses among lights after it has seen which of them reach it.
#pragma once

#include <cstdint>
#include <vector>

#include "baker/rays/lanes.h"

namespace lumel {

/// The choice by unshadowed light spends nearly all samples on a sun that walls keep out. This one takes the lights of
/// PunctualLights in groups (PunctualLights::groups) and chooses group g with the probability
///     (1 - e) I_g f_g / sum_k I_k f_k + e / n,
/// I_g being what g would bring to the receiver unshadowed, f_g the root of the share of it that has arrived so far,
/// and n the number of groups that could bring anything. (The root: a group that is visible with probability v has the
/// second moment I^2 v, and samples belong in proportion to its root.) The even share e, a tenth of what the factors
/// take away, guarantees that no light is lost: the choice is a defensive mixture (Hesterberg 1995) and unbiased,
/// whatever was learnt, as long as it was learnt from other samples; after Vevoda, Kondapaneni and Krivanek 2018. Where
/// all light arrives it is the unshadowed choice, which has hardly any noise then.
class LearntChoice {
 public:
  explicit LearntChoice(std::size_t groups = 0)
      : seen_(groups, 0.0), arrived_(groups, 0.0), factors_(groups, 1.0f), evenShares_(groups, kEvenUnknown) {}

  /// Tells whether there is anything to choose.
  bool isUseful() const { return factors_.size() > 1; }
  /// Enters what samples would bring unshadowed, and what of it arrived.
  void record(std::size_t group, float unshadowed, float arrived) {
    seen_[group] += static_cast<double>(unshadowed);
    arrived_[group] += static_cast<double>(arrived);
  }
  /// Makes the choice follow what was recorded until now. Precondition: no sample was drawn whose scramble goes on.
  void learn();

  float factor(std::size_t group) const { return factors_[group]; }
  /// Returns the even share that a group asks for where it would bring all light. Where several would, e is the mean of
  /// these by what each would bring.
  float evenShare(std::size_t group) const { return evenShares_[group]; }

  /// A group that was never sampled may be hidden or not: half of the samples are shared evenly.
  static constexpr float kEvenUnknown = 0.5f;
  /// A tenth costs the lights that arrive at most as much in variance.
  static constexpr float kEven = 0.1f;

 private:
  std::vector<double> seen_, arrived_;  // sums of luminance by group: unshadowed, and what arrived
  std::vector<float> factors_;
  std::vector<float> evenShares_;
};

}  // namespace lumel
