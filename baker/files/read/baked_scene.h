// A bake as a consumer finds it: read from the files of its folder alone, never from the baker's memory.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "lightmap/maps/rnm_basis.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

struct BakedScene {
  Scene scene;                              // scene.glb, with the sky of the bake as its environment
  std::vector<std::array<Image, 3>> pages;  // RNM maps by page
  RnmDecode decode = RnmDecode::Squared;    // as bake.json says
  Vec3 meanFlat{0, 0, 0};                   // mean irradiance / pi over all covered texels
};

/// bake.json, parsed and checked for its format. Errors: Input, naming the file.
Expected<nlohmann::ordered_json> readBakeJson(const std::filesystem::path& dir);

/// Reads bake.json, scene.glb, the RNM maps and the sky. Every lightmapPage of a primitive is a page that exists.
/// Errors: Input, naming the file that is missing, unreadable or does not fit the others.
Expected<BakedScene> readBake(const std::filesystem::path& dir);

}  // namespace lumel
