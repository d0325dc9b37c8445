// The standard error of texels whose samples are doubled again and again, from how far their means move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/waves/waves.h"
#include "lightmap/maps/encoding.h"

namespace lumel {

/// The texels of a wave have the same number of samples and are judged together.
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
/// texels of its wave and of those around it on the page, which count as much as kPrior doublings, unless the texel
/// moved more than they did: at the border of a shadow it knows better. Measured (four scenes, 32 to 1024 samples):
/// baker/README.md.
///
/// Texels beside each other on a page may be of places that share no light, one a million times as bright as the other.
/// So a texel whose place is darker than those around it takes less from them, by the square of `places`: per texel,
/// the light of its place (GatherState::places); empty: all are alike. For the rate each wave counts relative to its
/// own.
///
/// The maps of an encoding have their own d^2; the rate is the flat map's, since they are of the same samples, and half
/// as much credit again is taken (kMapCredit): with the flat map's, 97 to 98.4% of a Cornell box's texels lay within
/// their intervals (lightmap/maps/README.md has the figures with it).
///
/// Plain data: what is known of the errors of all texels between two passes.
struct DoublingError {
  static constexpr double kPrior = 4.0;
  static constexpr double kMapCredit = 1.5;

  /// `creditTaken`: 0 to 1.
  DoublingError(const Waves& waves, double creditTaken);
  DoublingError() = default;

  /// The means of a wave's texels were `before` from n0 samples and are `now` from n1 more as well. Waves may be added
  /// from several threads at once. `leftOut`: bit i is set where texel i took no samples; it never does again, and is
  /// given the error of those around it.
  void add(const Waves& waves, std::size_t wave, std::span<const float> before, std::span<const float> now,
           std::uint32_t n0, std::uint32_t n1, std::uint32_t leftOut = 0);
  /// The same for the maps of the encoding; before `add` or after it.
  using MapMeans = std::array<std::array<float, kLanes>, kMostMaps>;
  void addMaps(const Waves& waves, std::size_t wave, const MapMeans& before, const MapMeans& now, std::uint32_t n0,
               std::uint32_t n1, std::uint32_t leftOut = 0);
  /// Ends a pass in which every wave of `live` was added with the same n0 and n1: measures the rate, renews the errors.
  void endPass(const Waves& waves, const std::vector<std::uint8_t>& live, std::span<const float> places = {});

  /// Returns the standard error of the mean over all samples of the wave's texel `i`; NaN before the first doubling.
  float standardError(const Waves& waves, std::size_t wave, std::size_t i, std::span<const float> places = {}) const;
  /// Turns `mapSums`, of `maps` maps, into such standard errors; nothing can be added after that.
  std::vector<float> takeMapErrors(const Waves& waves, std::size_t maps, std::span<const float> places = {});

  /// What is known of the texels of a wave.
  struct OfWave {
    std::uint32_t counting = 0;  // texels not left out
    std::uint32_t samples = 0;
    std::uint32_t samplesBefore = 0;
    std::int32_t doublings = 0;
    double moved = -1.0;  // sum of d^2 over the texels
    double movedBefore = -1.0;
    double meanSquare = 0.0;  // mean d^2 over the texels and doublings
    double pool = 0.0;        // the same of the neighbourhood
    double place = 1.0;       // mean square of the places' light
    double poolPlace = 1.0;   // the same of the neighbourhood
    double factor = 1.0;      // variance / mean d^2

    /// Share of its neighbourhood's mean d^2 that a texel in a place of that light takes.
    double shareOfPool(double light) const;
  };
  static constexpr float kLeftOut = -1.0f;
  std::vector<OfWave> ofWaves;
  std::vector<float> squares;  // per texel, of the last pass: d^2; kLeftOut: it took no samples
  std::vector<float> sums;     // of d^2 over all passes, each scaled to the samples of the last; kLeftOut
  std::vector<float> mapSums;  // that of the encoding's maps, texel by texel; empty where they are not asked for
  double credit = 0.0;
  double rate = 1.2;  // until it is measured: what scenes have at 16 samples

 private:
  void pool(const Waves& waves, std::size_t wave);
  static double error(const OfWave& known, double factor, double own, double pool);
};

}  // namespace lumel
