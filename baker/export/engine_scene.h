// scene.glb of a bake as engines want it: one page for each node with a lightmap, names that tell nodes apart, no lamps
// whose light is in the maps already.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/math.h"
#include "scene/scene.h"

namespace lumel {

/// A binary glTF that lumel wrote, with its parts apart.
struct Glb {
  nlohmann::ordered_json json;
  std::vector<std::uint8_t> binary;

  /// Errors: Input, naming the file.
  static Expected<Glb> read(const std::filesystem::path& file);
  std::vector<std::uint8_t> bytes() const;
};

/// A node with a lightmap. Page UV = TEXCOORD_1 * scale + offset, v down.
struct LitNode {
  std::string name;
  LightmapPlace place;
};

struct EngineSceneOptions {
  bool keepLights = false;  // lamps that are baked in full, too; others always stay
  bool godotNames = false;  // names that Godot's importer leaves as they are
  bool unitPlaces = false;  // rectangles beyond 0..1 become page UVs in the mesh: for readers that store them so
};

struct EngineScene {
  Glb glb;
  std::vector<LitNode> nodes;
};

/// Reads `dir`/scene.glb. A node whose primitives lie on several pages becomes several; extras.lumel of each lit node
/// states page, scale and offset. Errors: Input, naming what is wrong.
Expected<EngineScene> engineScene(const std::filesystem::path& dir, const EngineSceneOptions& options);

}  // namespace lumel
