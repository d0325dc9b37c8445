// Charts of lightmap UVs that came with the scene.
#pragma once

#include "lightmap/atlas/assemble.h"
#include "lightmap/atlas/atlas_options.h"

namespace lumel {

/// The instance's triangles at their TEXCOORD_1 on `page`, and its charts (triangles that share points and UVs)
/// appended to atlas.charts. Counts texels of charts that cross a break of the material's frame in `report`.
std::vector<PlacedTriangle> placeSceneUvs(const Scene& scene, int instance, int page, int pageSize, Atlas& atlas,
                                          UvReport& report);

}  // namespace lumel
