// The last steps before a bake is written: noise is taken out, texels that have no light of their own get their
// neighbours'.
#pragma once

#include <vector>

#include "baker/bake/bake.h"
#include "lightmap/maps/encoding.h"
#include "lightmap/seams/seam_maps.h"
#include "lightmap/seams/seams.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

struct FinishOptions {
  bool denoise = false;
  int rings = 0;                 // of texels that maps grow by, beyond what is covered
  const Seams* seams = nullptr;  // where lookups from both sides shall agree; of no effect without rings
  // What of the maps belongs together (Encoding::groups), the first encoding's first: its maps tell, with the flat one,
  // where noise is taken out. Empty: all of them do, and none is negative.
  std::vector<MapGroup> groups{};
};

/// First noise is taken out of the maps, if asked for (lightmap/denoise.h); invalid texels take no part.
/// A covered texel whose rays mostly met the backs of surfaces (validity under one half: it lies inside a wall, under
/// a pillar) takes the light of the nearest valid texels of its chart, where the chart has any; it would leak darkness
/// into bilinear lookups beside it. At seams, the texels beyond a chart's border take the light of the other side
/// before noise is taken out, and lookups from both sides are made to agree after. Then every map grows by `rings`, so
/// that a lookup at a chart's border does not mix in black. The errors that pages state become those of the maps as
/// they are then, also where these were grown; the other aux channels stay as they are and tell own values from others.
SeamFigures finishPages(std::vector<BakedPage>& pages, const Atlas& atlas, const std::vector<PageTexels>& texels,
                        const FinishOptions& options);

/// Replaces the sampled maps by those that are stored: of each of Encoding::stored in turn, but for the flat map. After
/// finishPages: from here on maps may hold directions. Of no effect on an encoding that stores what it samples.
void encodePages(std::vector<BakedPage>& pages, const Encoding& encoding);

/// Cuts light beyond kMostHalf, with a note in the figures that says how many values that were and how large.
void cutToHalf(BakeResult& result);

}  // namespace lumel
