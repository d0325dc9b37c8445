// Triangles that are longer than a page are cut before charts are made: no chart can hold them.
#pragma once

#include <cstddef>

#include "lightmap/atlas/atlas_options.h"
#include "scene/scene.h"

namespace lumel {

struct SplitReport {
  std::size_t triangles = 0;  // that were too long
  std::size_t pieces = 0;     // that took their place
};

/// Cuts edges that are too long for charts of AtlasOptions::texelsPerMeter at their middle, again and again, in meshes
/// that get generated charts. An edge's length alone decides, so that triangles on both sides of it are cut alike and
/// no gap opens. Vertices that are added have the mean of all attributes. Does nothing without a density (charts are
/// then scaled until they fit), nor where the surface would fill more than a thousand pages: buildAtlas refuses that.
SplitReport splitLongTriangles(Scene& scene, const AtlasOptions& options);

}  // namespace lumel
