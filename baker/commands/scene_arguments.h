// The options that say what is to be lit: those of every subcommand that bakes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "baker/commands/options.h"
#include "lightmap/atlas/atlas.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/files/load_options.h"
#include "scene/scene.h"

namespace lumel {

/// The side of a double-sided surface that gets the lightmap.
enum class DoubleSided {
  Lit,    // the one that is wound to be its front, or the other where only that is lit (turnToLight)
  Wound,  // the one that is wound to be its front
};

/// What becomes of meshes that paint the sky around a level (findSkyDomes).
enum class SkyDome {
  Keep,      // they stay, with a warning where they keep light out
  LeaveOut,  // they neither cast nor receive
};

struct SceneArguments {
  std::filesystem::path scene;
  bool allowOutsidePaths = false;
  std::string ssbump;  // "MATERIAL=FILE,MATERIAL=FILE"
  DoubleSided doubleSided = DoubleSided::Lit;
  SkyDome skyDome = SkyDome::Keep;
  LightUnits lightUnits = LightUnits::Auto;
  Vec3 skyColor{0, 0, 0};
  std::filesystem::path sky;
  float skyRotation = 0.0f;
  float skyStrength = 1.0f;
};

void declareScene(OptionTable& options, SceneArguments& a);
void declareOutsidePaths(OptionTable& options, SceneArguments& a);
void declareSsbump(OptionTable& options, SceneArguments& a);
void declareAtlasOptions(OptionTable& options, AtlasOptions& atlas);
void declareSky(OptionTable& options, SceneArguments& a);
void declareSkyAndSides(OptionTable& options, SceneArguments& a);

/// What the options cannot check one by one. Errors: Usage.
Expected<void> checkSky(const SceneArguments& a);
Expected<void> checkAtlas(const AtlasOptions& atlas);

/// The scene with its sky; without any light a warning in its report says so. Errors: Input.
Expected<Scene> loadSceneUnderSky(const SceneArguments& a);

/// The scene with its sky, double-sided surfaces turned as asked for. Errors: Input, and those of turnToLight.
Expected<Scene> loadLitScene(const SceneArguments& a, const Progress& progress);

/// Whether anything shines.
bool hasLight(const Scene& scene);

/// What was taken for granted, on stderr.
void printNotes(const std::vector<std::string>& notes);
/// The first few on stderr.
void printWarnings(const std::vector<std::string>& warnings);

}  // namespace lumel
