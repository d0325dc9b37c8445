// A chart with its place in the plane, and what may become of such charts when they are joined.
#pragma once

#include <vector>

#include "lightmap/charts/chart_mesh.h"

namespace lumel {

struct FlatChart {
  ChartMesh mesh;
  std::vector<Vec2d> uvs;  // texels, y up
};

struct MergeOptions {
  double maxStretch = 1.25;
  double largestSide = 1000.0;  // texels
};

}  // namespace lumel
