// What every study of a scene begins with.
#pragma once

#include "lightmap/atlas/atlas.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/scene.h"

namespace lumel {

/// Of this process, all threads together.
double cpuSecondsNow();

/// Builds an atlas; where the charts do not fit the page at any density, the page is doubled, up to 4096 texels, and
/// `options` say so. Errors: those of buildAtlas.
Expected<AtlasResult> atlasThatFits(const Scene& scene, AtlasOptions& options, Progress& progress);

}  // namespace lumel
