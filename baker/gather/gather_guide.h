// Where the gather rays of a wave go: more of them to where the light that they find differs more, since that is where
// samples are wanting (Neyman 1934; learnt from rays before and drawn by stretching the square that directions are made
// of as in Mueller et al. 2017, "Practical Path Guiding"). The points of a net keep their order in the stretched square,
// so that they still cover it evenly.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "baker/rays/sampling.h"
#include "lightmap/maps/projection.h"

namespace lumel {

/// Bins of the unit square that sampleGatherHemisphere makes directions of: rows along u.x, from the normal to the
/// horizon, columns along u.y, around the normal.
inline constexpr std::uint32_t kGuideRows = 4;
inline constexpr std::uint32_t kGuideColumns = 8;
inline constexpr std::uint32_t kGuideBins = kGuideRows * kGuideColumns;

/// The bin of a direction, `turn` being its azimuth as a share of a full turn in [0, 1).
inline std::uint32_t guideBin(float z, float turn) {
  const auto row = static_cast<std::uint32_t>((1.0f - 0.5f * (z * z + z)) * static_cast<float>(kGuideRows));
  const auto column = static_cast<std::uint32_t>(turn * static_cast<float>(kGuideColumns));
  return std::min(row, kGuideRows - 1) * kGuideColumns + std::min(column, kGuideColumns - 1);
}

/// What rays found, by the bin that they went to.
struct GuideTally {
  std::array<float, kGuideBins> rays{};
  std::array<float, kGuideBins> light{};  // sums of luminance and of its squares
  std::array<float, kGuideBins> squares{};

  void add(std::uint32_t bin, float luminance);
  void add(const GuideTally& other);
};

/// A map of the unit square onto itself, from where points are drawn to where directions are taken: rows of equal
/// height become as high, and columns of equal width in them as wide, as these knots say. Linear in between.
struct Guide {
  static constexpr std::uint32_t kOne = 65536;
  /// Where rows and columns end that are not the last; in steps of 1 / kOne, each further than the one before.
  std::array<std::uint16_t, kGuideRows - 1> rows = {kOne / 4, kOne / 2, kOne / 4 * 3};
  std::array<std::array<std::uint16_t, kGuideColumns - 1>, kGuideRows> columns;

  /// Leaves every point in its place.
  Guide();
};

/// The same, as rays are aimed by it: u.x = x0 + dx * x and u.y = y0 + dy * y in a row and column of the points. A
/// direction found there has the density of the gather over dx * dy.
struct GuideTable {
  explicit GuideTable(const Guide& guide);
  std::array<float, kGuideRows> x0, dx;
  std::array<std::array<float, kGuideColumns>, kGuideRows> y0, dy;
};

/// Makes guides for the flat and the RNM maps alike: directions count by their errors' squares, summed over the maps.
class GuideMaker {
 public:
  explicit GuideMaker(const RnmKernels& kernels);

  /// Where nothing was found, or light whose squares are no floats: a guide that leaves all in its place.
  Guide make(const GuideTally& tally) const;

 private:
  // Of what a ray counts for in the maps, over a bin: mean square, and square of how far it is from its mean.
  std::array<double, kGuideBins> meanSquare_{};
  std::array<double, kGuideBins> variance_{};
};

}  // namespace lumel
