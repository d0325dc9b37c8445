// What a load may reach, and what it is given beside the file.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace lumel {

/// The unit that a file's lamps are taken to be in (scene/gltf/light_units.h).
enum class LightUnits {
  Auto,        // as the program that wrote the file does by its defaults
  Gltf,        // candela and lux, as glTF says
  Blender,     // 683 times the watts that Blender's exporter was given
  BlenderRaw,  // watts of all directions for points and spots, as Blender shows them
};

struct LoadOptions {
  bool allowOutsidePaths = false;  // buffers and images outside the scene's folder
  LightUnits lightUnits = LightUnits::Auto;
  std::vector<std::pair<std::string, std::filesystem::path>> ssbump = {};  // names of materials, and their maps
};

}  // namespace lumel
