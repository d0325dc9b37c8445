// `lumel info --lint`: the atlas that a bake would use, checked before the bake.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "lightmap/atlas/atlas.h"

namespace lumel {

struct SceneLintOptions {
  AtlasOptions atlas;
  std::filesystem::path pictures;  // folder for one PNG of charts per page; empty: none
};

/// With UvSource::Scene the scene's UVs are examined as they are, however wrong; charts are generated for the rest.
/// Object "atlas" (figures), "sceneUvs" (each TEXCOORD_1 that was examined), "findings" (what lintAtlas measures, those
/// with a count) and "lines" (the same for people). Errors: as buildAtlas; Failed where a picture cannot be written.
Expected<nlohmann::ordered_json> lintScene(const Scene& scene, const SceneLintOptions& options);

}  // namespace lumel
