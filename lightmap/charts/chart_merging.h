// Joining of flattened charts along common borders: a chart is moved rigidly to where its border meets its neighbour's.
// Cylinders, cones and arches unroll whole this way (the last edge stays a seam), and small charts find a larger one.
#pragma once

#include <vector>

#include "lightmap/charts/flat_chart.h"

namespace lumel {

/// Merges what can be merged without overlap, stretch beyond the limit, or a crease that light would show: cheapest
/// pair first, where sharp creases and short common borders are dear. Charts too small to hold detail (a few texels, or
/// thinner than one and a half) may be joined over sharper creases. Parallel over the mesh's connected parts,
/// deterministic.
std::vector<FlatChart> mergeCharts(const HalfEdgeMesh& mesh, std::vector<FlatChart> charts,
                                   const MergeOptions& options);

}  // namespace lumel
