// The options that say what is to be lit: those of every subcommand that bakes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "baker/options.h"
#include "lightmap/atlas.h"
#include "scene/expected.h"
#include "scene/scene.h"

namespace lumel {

struct SceneArguments {
  std::filesystem::path scene;
  bool allowOutsidePaths = false;
  Vec3 skyColor{0, 0, 0};
  std::filesystem::path sky;
  float skyRotation = 0.0f;
  float skyStrength = 1.0f;
};

void declareScene(OptionTable& options, SceneArguments& a);
void declareOutsidePaths(OptionTable& options, SceneArguments& a);
void declareAtlasOptions(OptionTable& options, AtlasOptions& atlas);
void declareSkyOptions(OptionTable& options, SceneArguments& a);

/// What the options cannot check one by one. Errors: Usage.
Expected<void> checkSky(const SceneArguments& a);
Expected<void> checkAtlas(const AtlasOptions& atlas);

/// The scene with its sky. Errors: Input.
Expected<Scene> loadLitScene(const SceneArguments& a);

/// Whether anything shines.
bool hasLight(const Scene& scene);

/// The first few on stderr.
void printWarnings(const std::vector<std::string>& warnings);

}  // namespace lumel
