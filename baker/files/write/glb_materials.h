// Materials, textures and images of a scene as glTF JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "baker/files/write/glb_buffer.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// TEXCOORD number in scene.glb of the source's UV set: lightmap UVs take 1, so sets 1 and up move one up.
inline int writtenUvSet(int sourceSet) { return sourceSet == 0 ? 0 : sourceSet + 1; }
inline constexpr int kLightmapUvSet = 1;

struct GlbMaterials {
  nlohmann::ordered_json materials = nlohmann::ordered_json::array();  // index for index as Scene::materials
  nlohmann::ordered_json textures = nlohmann::ordered_json::array();
  nlohmann::ordered_json images = nlohmann::ordered_json::array();
  nlohmann::ordered_json samplers = nlohmann::ordered_json::array();
  std::set<std::string> extensionsUsed;
  std::set<std::string> extensionsRequired;
};

/// Image bytes go into `buffer` as they are (PNG, JPEG, WebP) or as PNG. Images that no material uses are left out; an
/// image that is missing or cannot be read is left out with the references to it (loading warned of it).
/// Errors: Failed (the PNG encoder).
Expected<GlbMaterials> describeMaterials(const Scene& scene, GlbBuffer& buffer);

}  // namespace lumel
