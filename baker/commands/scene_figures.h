// What a scene holds, in figures, and what baking it would take.
#pragma once

#include <nlohmann/json.hpp>

#include "scene/scene.h"

namespace lumel {

struct EstimateOptions {
  float texelsPerMeter = 0.0f;  // 0: the density that fills one page
  int pageSize = 1024;
};

/// Counts, bounds, lists of materials, images, lights and cameras, the sky, the loader's warnings, and an estimate of
/// texels, pages, memory and disk space.
nlohmann::ordered_json describeScene(const Scene& scene, const EstimateOptions& options);

}  // namespace lumel
