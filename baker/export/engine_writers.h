// The engines' writers behind engine_export.h.
#pragma once

#include <nlohmann/json.hpp>

#include "baker/export/directional.h"
#include "baker/export/engine_export.h"
#include "baker/export/engine_scene.h"
#include "baker/export/export_folder.h"

namespace lumel {

/// What all of them write from.
struct EngineSource {
  const BakedScene& baked;  // with flat maps, aux and volumes; its encoding is the one that the engine reads
  const EngineScene& scene;
  std::vector<ChartTexels> texels;
  Progress& progress;
};

/// lightmap.exr (lightmap-1.exr and so on beyond 16384 rows), .import files, lightmap.tres and level.tscn; returns the
/// rows of "maps". Directional where the bake has the bands.
Expected<nlohmann::ordered_json> writeGodot(const EngineSource& source, ExportFolder& folder);

/// volume-<n>.ktx2 of every light volume; returns rows of file, translation and scale.
Expected<nlohmann::ordered_json> writeBevyVolumes(const EngineSource& source, ExportFolder& folder);

/// lightmap-<page>-dir.png of every page where the bake has the bands; returns rows of "maps".
Expected<nlohmann::ordered_json> writeUnityDirections(const EngineSource& source, ExportFolder& folder);

}  // namespace lumel
