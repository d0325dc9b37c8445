// The files of a bake (names and contents: README "File formats"), written so that a reader never sees half of them,
// and read back by the compositor and by `lumel info`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "baker/bake.h"
#include "lightmap/atlas.h"
#include "scene/expected.h"
#include "scene/scene.h"

namespace lumel {

struct StageTime {
  std::string stage;  // "load", "charts", "pack", "texels", "bake", "finish", "write"
  double seconds = 0.0;
};

/// Everything that bake.json records beside the pages themselves.
struct BakeRecord {
  std::filesystem::path sceneFile;
  AtlasOptions atlasOptions;
  BakeOptions bakeOptions;
  int dilate = 0;  // rings added around charts when writing
  bool half = false;
  int threads = 0;
  std::vector<StageTime> stages;
  std::size_t peakMemoryBytes = 0;
};

/// Writes bake.json, scene.glb and every page's images into `dir` (made if needed). Everything is written under
/// temporary names first; the old result stays whole until all of the new one is on disk, bake.json is renamed last.
/// Errors: Failed.
Expected<void> writeBake(const std::filesystem::path& dir, const Scene& scene, const AtlasResult& atlas,
                         const BakeResult& result, const BakeRecord& record);

}  // namespace lumel
