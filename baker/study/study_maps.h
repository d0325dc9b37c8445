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
  std::vector<std::vector<Vec3>> maps;  // of the encoding
  std::vector<float> standardError;
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

}  // namespace lumel
