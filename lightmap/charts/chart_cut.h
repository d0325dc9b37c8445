// Charts that no plane can take as they are: closed surfaces, and bands like a pipe, which one cut opens.
#pragma once

#include "lightmap/charts/chart_mesh.h"

namespace lumel {

enum class ChartForm {
  Disc,    // one border, or holes: may lie in the plane as it is
  Band,    // two borders, neither of which would go around the other in the plane: opens with a cut between them
  Closed,  // no border
};

ChartForm formOf(const ChartMesh& chart);

/// A band cut along the shortest way over its edges from one border to the other. The parts of `chart` stay where they
/// are in the list; both sides of the cut become border.
void cutBand(const HalfEdgeMesh& mesh, ChartMesh& chart);

}  // namespace lumel
