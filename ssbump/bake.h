// A height map to its ssbump maps, in tiles: memory stays near that of the heights themselves.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/base/progress.h"
#include "ssbump/maps/bake_report.h"
#include "ssbump/maps/map_set.h"
#include "ssbump/occlusion/height_field.h"
#include "ssbump/occlusion/horizon.h"
#include "ssbump/occlusion/ray_occlusion.h"

namespace lumel::ssbump {

enum class BackEnd { Horizon, Rays };

struct BakeSettings {
  HeightOptions height;
  int bilateralRadius = 0;             // texels; 0: no filter
  float bilateralThresholdTexels = 0;  // 0: as many steps of the file's bit depth as the radius has texels
  std::filesystem::path normalMap;     // empty: normals derived from the heights
  Green normalMapGreen = Green::Up;
  BackEnd backEnd = BackEnd::Horizon;
  HorizonSettings horizon;
  RaySettings rays;
  MapSettings maps;
  int tileWidth = 2048, tileHeight = 1024;  // even; results do not depend on them
};

/// Everything from files to files. Errors: Input, Usage, Failed, Interrupted; none leaves a file behind.
Expected<BakeReport> bakeHeightMap(const std::filesystem::path& input, const BakeSettings& settings,
                                   Progress& progress);

struct BakedInMemory {
  HeightField field;
  Image normals;    // (t, b, n)
  Image occlusion;  // one channel per lobe
};

/// The same without files, for maps that fit in memory whole.
Expected<BakedInMemory> bakeInMemory(const std::filesystem::path& input, const BakeSettings& settings,
                                     std::span<const Lobe> lobes, Progress& progress);

}  // namespace lumel::ssbump
