// Charts laid into the plane.
#pragma once

#include "lightmap/charts/chart_mesh.h"

namespace lumel {

struct Flattening {
  std::vector<Vec2d> uvs;  // per point of the chart, texels, y up; orientation kept, scaled to the surface's area
  bool valid = false;      // no flips, stretch within the limit, no overlap, within the largest side
};

struct FlattenOptions {
  double maxStretch = 1.25;
  double largestSide = 1000.0;  // texels
};

/// Flat charts by projection, which is isometric; bent ones unrolled triangle by triangle and then relaxed as rigidly
/// as possible (Liu, Zhang, Xu, Gotsman and Gortler 2008, "A Local/Global Approach to Mesh Parameterization").
/// A single triangle is always valid unless it is too large.
Flattening flatten(const ChartMesh& chart, const FlattenOptions& options);

}  // namespace lumel
