// What a scene holds, in figures, and what baking it would take.
#pragma once

#include <nlohmann/json.hpp>

#include "lightmap/atlas/atlas_options.h"
#include "scene/scene.h"

namespace lumel {

/// Counts, bounds, lists of materials, images, lights and cameras, the sky, the loader's warnings, what a bake with
/// these options takes the lightmap UVs for, and an estimate of its texels, pages, memory and disk space.
nlohmann::ordered_json describeScene(const Scene& scene, const AtlasOptions& options);

}  // namespace lumel
