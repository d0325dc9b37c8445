// Charts of lightmap UVs that came with the scene.
#pragma once

#include "lightmap/atlas/assemble.h"
#include "lightmap/atlas/atlas_options.h"

namespace lumel {

/// The instance's triangles at their TEXCOORD_1, moved to `place` on its page of `pageSize` texels, and its charts
/// (triangles that share points and UVs) appended to atlas.charts. Counts texels of charts that cross a break of the
/// material's frame in `report`.
std::vector<PlacedTriangle> placeSceneUvs(const Scene& scene, int instance, const LightmapPlace& place,
                                          const Vec2d& pageSize, Atlas& atlas, UvReport& report);

}  // namespace lumel
