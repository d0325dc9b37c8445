// The standard error of texels whose samples are doubled again and again, from how far their means move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/texels/texels.h"

namespace lumel {

/// Texels of pages in runs of kLanes in their order (waves), which have the same number of samples and are judged
/// together. A run never spans pages.
///
/// When n samples become 2n let d be half the difference between the means of the two halves. If the halves were
/// independent E[d^2] would be the variance of the mean of all. Those of an Owen-scrambled sequence are better than
/// that, their errors partly cancel: with a variance that falls as n^-rate E[d^2] = (2^rate - 1) times the variance
/// (since V(n) + E[d^2] = V(n/2), and V(n/2) = 2^rate V(n)). The rate is measured, by how d^2 falls over all texels.
/// `credit` of it is taken: the variance is d^2 / (2^rate - 1)^credit. The rest pays for
/// what d^2 cannot see, the noise that both halves took from the same cache, and for tails heavier than a normal
/// distribution's. The credit is a calibration; with it 93 to 97% of texels lie within 1.96 standard errors (README).
///
/// One d^2 is hardly an estimate, so others join: the texel's earlier doublings, scaled to the present by the rate; the
/// texels of its run and of those around it on the page, which count as much as kPrior doublings, unless the texel
/// moved more than they did: at the border of a shadow it knows better. Measured (four scenes, 32 to 1024 samples):
/// baker/README.md.
class DoublingError {
 public:
  static constexpr double kPrior = 4.0;

  /// `credit`: 0 to 1. Runs are numbered through.
  DoublingError(const std::vector<PageTexels>& pages, double credit);

  /// The means of a run's texels were `before` from n0 samples and are `now` from n1 more as well. Runs may be called
  /// from several threads at once. `leftOut`: bit i is set where texel i took no samples; it never does again, and is
  /// given the error of those around it.
  void add(std::size_t run, std::span<const float> before, std::span<const float> now, std::uint32_t n0,
           std::uint32_t n1, std::uint32_t leftOut = 0);
  /// Ends a pass in which every run of `live` was added with the same n0 and n1: measures the rate, renews the errors.
  void endPass(const std::vector<std::uint8_t>& live);

  /// Of the mean over all samples of the run's texel `i`; 0 before the first doubling.
  float standardError(std::size_t run, std::size_t i) const;
  /// The runs in a run's tile and in the eight around it; kNone where there is none.
  static constexpr std::uint32_t kNone = 0xffffffffu;
  const std::array<std::uint32_t, 9>& around(std::size_t run) const { return around_[run]; }
  double rate() const { return rate_; }

 private:
  struct Run {
    std::size_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t counting = 0;  // texels not left out
    std::uint32_t samples = 0;
    std::uint32_t samplesBefore = 0;
    int doublings = 0;
    double moved = -1.0;  // sum of d^2 over the texels
    double movedBefore = -1.0;
    double meanSquare = 0.0;  // mean d^2 over the texels and doublings
    double pool = 0.0;        // the same of the neighbourhood
    double factor = 1.0;      // variance / mean d^2
  };
  void addPage(const PageTexels& page);
  double poolAround(std::size_t run) const;

  std::vector<Run> runs_;
  std::vector<std::array<std::uint32_t, 9>> around_;
  std::vector<float> squares_;              // of the last pass: d^2
  std::vector<float> sums_;                 // of d^2 over all passes, each scaled to the samples of the last
  static constexpr float kLeftOut = -1.0f;  // both
  double credit_;
  double rate_ = 1.2;  // until it is measured: what scenes have at 16 samples
};

}  // namespace lumel
