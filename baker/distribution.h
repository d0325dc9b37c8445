// Choice of an index in proportion to given weights.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace lumel {

/// Cumulative table over n weights, chosen by inversion, so stratified u stay stratified.
/// The table's entries are multiples of 2^-24, the grid on which the samplers' u lie: the probability that is
/// reported is exactly the share of u that chooses an index, for any number of weights. Every positive weight keeps
/// at least one step of that grid (if there are fewer than 2^22 of them), however small its share.
class Distribution {
 public:
  Distribution() = default;
  /// Weights that are negative or not finite count as zero. Where all are zero the distribution is empty().
  explicit Distribution(std::span<const float> weights);

  bool empty() const { return cumulative_.empty(); }
  std::size_t size() const { return empty() ? 0 : cumulative_.size() - 1; }
  /// Sum of the weights.
  double total() const { return total_; }

  /// The index chosen by u in [0, 1). Density over indices: probability(index) > 0. Precondition: not empty().
  std::size_t choose(float u) const;
  /// Where u lies within the interval of `index`, in [0, 1): to use u once more.
  float rest(float u, std::size_t index) const;
  float probability(std::size_t index) const { return cumulative_[index + 1] - cumulative_[index]; }

 private:
  std::vector<float> cumulative_;
  double total_ = 0.0;
};

}  // namespace lumel
