// The files of a bake (names and contents: README "File formats"), written so that a reader never sees half of them,
// and read back by the compositor and by `lumel info`.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "baker/bake/bake.h"
#include "baker/files/write/glb_writer.h"
#include "lightmap/atlas/atlas.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

struct StageTime {
  std::string stage;  // "load", "atlas", "texels", "bake", "finish", "write"
  double seconds = 0.0;
};

/// Everything that bake.json records beside the pages themselves.
struct BakeRecord {
  std::filesystem::path sceneFile;
  AtlasOptions atlasOptions;
  BakeOptions bakeOptions;
  int dilate = 0;  // rings added around charts when writing
  bool half = false;
  SceneForm sceneForm = SceneForm::Instances;
  int threads = 0;
  std::vector<StageTime> stages;
  std::size_t peakMemoryBytes = 0;
  nlohmann::ordered_json settings;  // every option as resolved, for the reader
};

/// Writes bake.json, scene.glb, every page's images and, where the scene has one, the sky (sky.exr) into `dir` (made if
/// needed). Everything is written to a folder inside `dir` first; the old result stays whole until all of the new one
/// is on disk. Then the old files move into that folder, bake.json first, and the new ones to their places, bake.json
/// last; if a step fails, the old ones are put back. Nothing of an older, larger bake stays.
/// Killed between these renames, `dir` has no bake.json, so nothing is taken for a bake, until FileSet::recover.
/// Everything but bake.json's "run" (times, threads, memory) is the same for the same scene and settings.
/// Errors: Failed.
Expected<void> writeBake(const std::filesystem::path& dir, const Scene& scene, const AtlasResult& atlas,
                         const BakeResult& result, const BakeRecord& record);

}  // namespace lumel
