// Everything that an engine needs of a bake, in its own formats.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "baker/export/export_folder.h"
#include "lightmap/formats/texel_format.h"
#include "scene/base/progress.h"

namespace lumel {

enum class Engine { Three, Godot, Bevy, Unity };

struct EngineExportOptions {
  Engine engine = Engine::Three;
  std::optional<TexelFormat> texels;  // of KTX2 maps; empty: half for three, rgb9e5 for Bevy
  std::string encoding;               // of three's maps; empty: the bake's first
  bool keepLights = false;            // lamps whose light is in the maps stay in scene.glb
};

/// What is written: scene.glb, maps, tables, README.md.
/// three: KTX2 of all maps, lumel-three.js. godot: lightmap.exr (and so on), its .import, lightmap.tres
/// (LightmapGIData), level.tscn. bevy: KTX2 of flat maps, irradiance volumes. unity: half EXR of flat maps, directional
/// PNG, LumelLightmaps.cs. Formats and units: README.md of this folder. `bakeJson`: that of `bake`. Returns the
/// description for export.json. Errors: Usage, Input, Failed, Interrupted.
Expected<nlohmann::ordered_json> exportFor(const std::filesystem::path& bake, const nlohmann::ordered_json& bakeJson,
                                           const EngineExportOptions& options, ExportFolder& folder,
                                           Progress& progress);

}  // namespace lumel
