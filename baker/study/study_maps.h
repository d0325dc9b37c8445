// The maps of a study's bakes, texel by texel, and how far they are apart.
#pragma once

#include <cstdint>
#include <vector>

#include "baker/bake/bake.h"

namespace lumel {

/// Per page, row by row: whether the texel counts in a comparison.
using StudyMask = std::vector<std::vector<std::uint8_t>>;

/// The values of all texels that count, page by page and row by row.
struct StudyMaps {
  std::vector<Vec3> flat;
  std::vector<std::vector<Vec3>> maps;        // of the encoding
  std::vector<float> standardError;           // of the flat map; NaN: not known
  std::vector<std::vector<float>> mapErrors;  // the same of the encoding's maps
};

/// The texels that mean the same to path tracing and to the gather: if part of a texel is inside of something, only
/// path tracing counts that part.
StudyMask validTexels(const std::vector<BakedPage>& pages);

StudyMaps mapsOf(const std::vector<BakedPage>& pages, const StudyMask& mask);

/// Over RGB; 0 without any texel.
double meanOf(const std::vector<Vec3>& map);

/// Mean square and mean of a - b over all values.
struct MapDifference {
  double square = 0.0;
  double mean = 0.0;
};

/// Precondition: the same size.
MapDifference differenceOf(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

/// How many texels lie within the intervals that are stated.
struct WithinInterval {
  std::size_t lit = 0;
  std::size_t within = 0;
  double claimed = 0.0;  // sum of squared standard errors over all texels where they are known

  /// Negative where nothing is stated.
  double share() const {
    return lit > 0 && claimed > 0.0 ? static_cast<double>(within) / static_cast<double>(lit) : -1.0;
  }
  void operator+=(const WithinInterval& other);
};

/// Compares luminances: a texel is within if it differs by at most 1.96 of the standard errors of both. Texels count
/// where the truth is more than `least`. Precondition: the same size.
WithinInterval withinInterval(const std::vector<Vec3>& map, const std::vector<float>& errors,
                              const std::vector<Vec3>& truth, const std::vector<float>& truthErrors, double least);

}  // namespace lumel
