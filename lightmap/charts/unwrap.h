// From a triangle soup to flattened charts.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lightmap/charts/triangle_soup.h"

namespace lumel {

struct UnwrapOptions {
  double maxStretch = 1.25;
  double largestSide = 1000.0;  // texels: no chart is longer, so that it fits a page
};

/// A flattened chart. Orientation is kept: what is counter-clockwise on the front is so here, with y up.
struct UnwrappedChart {
  std::vector<std::uint32_t> triangles;               // of the soup
  std::vector<std::array<std::uint32_t, 3>> corners;  // per triangle: into uvs
  std::vector<Vec2> uvs;                              // texels, y up, uniform density
};

struct Unwrapped {
  std::vector<UnwrappedChart> charts;  // ordered by their first triangle
  std::size_t degenerateTriangles = 0;
  std::size_t nonManifoldEdges = 0;
};

/// Deterministic; parallel over charts. Takes the soup, to be rid of it before memory is at its peak.
Unwrapped unwrap(TriangleSoup&& soup, const UnwrapOptions& options);

}  // namespace lumel
