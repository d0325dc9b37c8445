// Choice of an index in proportion to given weights.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/lanes.h"

namespace lumel {

/// Cumulative tables over n weights, chosen by inversion, so stratified u stay stratified; a guide table says where in
/// it to begin, so that a choice takes two steps on average, whatever n is (Chen and Asau 1974).
/// A table's entries are multiples of 2^-24, the grid on which the samplers' u lie: the probability that is reported is
/// exactly the share of u that chooses an index, for any number of weights. Every positive weight keeps at least one
/// step of that grid (if there are fewer than 2^22 of them), however small its share.
class Distribution {
 public:
  Distribution() = default;
  /// `rows` distributions side by side, of as many weights each. Weights that are negative or not finite count as zero.
  /// Where all of a row are zero it is empty(). Memory: 8 bytes per weight.
  explicit Distribution(std::span<const float> weights, std::size_t rows = 1);

  bool empty(std::size_t row = 0) const { return row >= totals_.size() || !(totals_[row] > 0.0); }
  std::size_t size() const { return size_; }
  /// Sum of a row's weights.
  double total(std::size_t row = 0) const { return totals_[row]; }

  /// The index chosen by u in [0, 1). Density over indices: probability(index) > 0. Precondition: not empty().
  std::size_t choose(float u, std::size_t row = 0) const;
  /// Where u lies within the interval of `index`, in [0, 1): to use u once more.
  float rest(float u, std::size_t index, std::size_t row = 0) const;
  float probability(std::size_t index, std::size_t row = 0) const {
    const float* cumulative = cumulativeOf(row);
    return cumulative[index + 1] - cumulative[index];
  }

  /// choose() and rest() for all lanes, each in a row of its own.
  struct Lanes {
    alignas(64) int index[kLanes];
    alignas(64) float rest[kLanes];
  };
  void choose(const float* u, const LaneFlags& rows, Lanes& chosen) const;

 private:
  /// So many entries are compared at once.
  static constexpr std::size_t kAhead = 4;

  void fill(std::span<const float> weights, std::size_t row);
  const float* cumulativeOf(std::size_t row) const { return cumulative_.data() + row * (size_ + kAhead); }
  std::size_t guideTo(float u, std::size_t row) const;
  static std::size_t advance(const float* cumulative, std::size_t index, float u);

  std::size_t size_ = 0;
  std::vector<float> cumulative_;    // [rows][size + kAhead], from 0 to as many ones as make it full
  std::vector<std::int32_t> guide_;  // [rows][size]: of u in [i, i + 1) / size, an index that is not too late
  std::vector<double> totals_;
};

}  // namespace lumel
