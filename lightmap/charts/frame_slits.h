// Charts that wrap around a break of the material's frame and lie on both sides of it without a gap.
#pragma once

#include <vector>

#include "lightmap/charts/flat_chart.h"

namespace lumel {

/// Sides of a break that lie nearer than this (texels) are read together by one lookup.
inline constexpr double kFrameGap = 1.0;

/// Whether both sides of the break are in the chart and nearer than kFrameGap.
bool isClosed(const FlatChart& chart, const FrameBreak& edge);

/// An edge at which the frame breaks is a cut in its chart, but both sides may still have got the same place (a flat
/// chart closed around it): bilinear lookup would mix two frames there. Such charts are split between the two sides;
/// their parts keep their UVs.
std::vector<FlatChart> splitAtFrameSlits(const HalfEdgeMesh& mesh, std::vector<FlatChart> charts);

}  // namespace lumel
