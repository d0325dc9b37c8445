// The last steps before a bake is written: texels that have no light of their own get their neighbours'.
#pragma once

#include <vector>

#include "baker/bake.h"
#include "lightmap/surface.h"
#include "lightmap/texels.h"

namespace lumel {

/// A covered texel whose rays mostly met the backs of surfaces (validity under one half: it lies inside a wall, under
/// a pillar) takes the light of the nearest valid texels of its chart, where the chart has any; it would leak darkness
/// into bilinear lookups beside it. Then every map grows by `rings` texels beyond what is covered, so that a lookup at
/// a chart's border does not mix in black. The aux images stay as they are: they still tell own values from others.
void finishPages(std::vector<BakedPage>& pages, const Atlas& atlas, const std::vector<PageTexels>& texels, int rings);

}  // namespace lumel
