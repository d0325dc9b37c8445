// Choice of an index in proportion to given weights.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/rays/lanes.h"

namespace lumel {

/// Chooses an index by inverting a cumulative table over n weights, so stratified u stay stratified; a guide table says
/// where in it to begin, so that a choice takes two steps on average, whatever n is (Chen and Asau 1974). A table's
/// entries are multiples of 2^-24, the grid on which the samplers' u lie: the probability that is reported is exactly
/// the share of u that chooses an index, for any number of weights. Every positive weight keeps at least one step of
/// that grid (if there are fewer than 2^22 of them), however small its share.
class Distribution {
 public:
  Distribution() = default;
  /// Weights that are negative or not finite count as zero. Where all are zero it is empty(). Memory: 8 bytes per
  /// weight.
  explicit Distribution(std::span<const float> weights);

  bool empty() const { return !(total_ > 0.0); }
  std::size_t size() const { return size_; }
  /// Returns the sum of the weights.
  double total() const { return total_; }

  float probability(std::size_t index) const { return cumulative_[index + 1] - cumulative_[index]; }

  struct Lanes {
    alignas(64) int index[kLanes];
    alignas(64) float rest[kLanes];  // where u lies within the index's interval, in [0, 1): to use u once more
  };
  /// The index that each of kLanes numbers u in [0, 1) chooses. Density over indices: probability(index) > 0.
  /// Precondition: not empty().
  void choose(const float* u, Lanes& chosen) const;

 private:
  /// So many entries are compared at once.
  static constexpr std::size_t kAhead = 4;

  std::size_t guideTo(float u) const;
  std::size_t advance(std::size_t index, float u) const;

  std::size_t size_ = 0;
  std::vector<float> cumulative_;    // [size + kAhead], from 0 to as many ones as make it full
  std::vector<std::int32_t> guide_;  // [size]: of u in [i, i + 1) / size, an index that is not too late
  double total_ = 0.0;
};

/// Holds distributions side by side, with as many weights in each, for tables that are larger than a processor's
/// caches: they take 2 bytes per weight, of which a choice reads one part. They are coarser: the shares of n weights
/// are multiples of 2^-15, within 2^-15 (and n 2^-15 of their size) of what they should be, and every positive weight
/// keeps one. The probability that is reported is exactly the share of u, as above.
class DistributionRows {
 public:
  static constexpr std::size_t kMostWeights = 4096;

  DistributionRows() = default;
  /// Precondition: rows > 0, and no more than kMostWeights in each.
  DistributionRows(std::span<const float> weights, std::size_t rows);

  bool empty(std::size_t row) const { return !(totals_[row] > 0.0); }
  double total(std::size_t row) const { return totals_[row]; }
  float probability(std::size_t index, std::size_t row) const {
    const std::uint16_t* lowest = lowest_.data() + row * stride_;
    return static_cast<float>(lowest[index + 1] - lowest[index]) * 0x1p-15f;
  }
  /// Chooses an index for each lane in the row given. Precondition: none of these rows is empty().
  void choose(const float* u, const LaneFlags& rows, Distribution::Lanes& chosen) const;

 private:
  static constexpr std::size_t kParts = 32;
  /// So many entries are compared at once.
  static constexpr std::size_t kAhead = 32;

  void fill(std::span<const float> weights, std::size_t row);
  static void find(const DistributionRows& all, const float* u, const LaneFlags& rows, Distribution::Lanes& chosen);

  std::size_t size_ = 0;
  std::size_t partSize_ = 0;
  std::size_t stride_ = 0;
  std::vector<std::uint16_t> lowest_;   // [rows][stride]: where each index begins, in steps; the rest is full
  std::vector<std::uint16_t> ofParts_;  // [rows][kParts]: of the first of every partSize_
  std::vector<double> totals_;
};

}  // namespace lumel
