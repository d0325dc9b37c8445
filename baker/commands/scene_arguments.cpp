#include "baker/commands/scene_arguments.h"

#include <algorithm>
#include <cstdio>

#include "baker/bake/lit_sides.h"
#include "scene/base/split_text.h"
#include "scene/images/environment.h"
#include "scene/images/image_io.h"
#include "scene/load/load_scene.h"
#include "scene/triangles/sky_dome.h"
#include "ssbump/maps/convert.h"

namespace lumel {

void declareScene(OptionTable& options, SceneArguments& a) {
  options.positionalPath("scene", a.scene, "Scene: .gltf, .glb or .obj").placeholder = "SCENE";
}

void declareOutsidePaths(OptionTable& options, SceneArguments& a) {
  options.flag("allow-outside-paths", a.allowOutsidePaths, "Let the scene name files outside its own folder");
}

void declareSsbump(OptionTable& options, SceneArguments& a) {
  options
      .text("ssbump", a.ssbump,
            "ssbump maps of materials, by their names, separated by commas; they go before those that the scene names "
            "itself (extras.lumel.ssbump)")
      .placeholder = "MATERIAL=FILE,...";
  options.find("ssbump")->defaultText = "none";
}

/// Errors: Usage.
static Expected<LoadOptions> loadOptionsOf(const SceneArguments& a) {
  LoadOptions options{.allowOutsidePaths = a.allowOutsidePaths, .lightUnits = a.lightUnits};
  if (a.ssbump.empty()) return options;
  for (const std::string& pair : splitText(a.ssbump, ',')) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size())
      return usageError("--ssbump: '" + pair + "' is not of the form MATERIAL=FILE");
    options.ssbump.emplace_back(pair.substr(0, equals), pair.substr(equals + 1));
  }
  return options;
}

/// What the channels of the scene's ssbump maps hold: what a file's own metadata say wins. Errors: Input.
static Expected<void> settleSsbumpForms(Scene& scene) {
  for (Material& material : scene.materials) {
    if (!material.ssbumpMap) continue;
    const ImageSource& source = scene.images[static_cast<std::size_t>(material.ssbumpMap.image)];
    const auto loaded = readImage(source.encoded, source.name);
    if (!loaded) return loaded.error();
    auto encoding = ssbump::materialEncoding(*loaded, material.ssbumpForm, material.ssbumpHand);
    if (!encoding)
      return inputError("material '" + material.name + "': " + source.name + ": " + encoding.error().message);
    material.ssbumpForm = ssbump::nameOf(encoding->convention);
    material.ssbumpHand = ssbump::nameOf(encoding->hand);
  }
  return {};
}

void declareAtlasOptions(OptionTable& options, AtlasOptions& atlas) {
  options.group("Atlas");
  options.choice(
      "uv", atlas.uvSource, {"auto", "scene", "object", "generate"},
      "Lightmap UVs: TEXCOORD_1 where it is valid, else generated (auto); TEXCOORD_1 as the place on a page, "
      "or an error (scene); TEXCOORD_1 as each object's own, with a rectangle for each at the density "
      "(object; auto does so where UVs of objects overlap); always generated (generate)");
  options.number("texels-per-meter", atlas.texelsPerMeter, {0.0f, 1e6f},
                 "Texel density; 0: the density that fills one page");
  options.integer("page-size", atlas.pageSize, {4, 16384}, "Texels on a side of a page, a multiple of 4");
  options.integer("padding", atlas.padding, {0, 256}, "Texels kept free between charts, at least");
  options.number("max-stretch", atlas.maxStretch, {1.0f, 1000.0f},
                 "A chart whose texels are stretched more than this is split");
  options.integer("block-align", atlas.blockAlign, {0, 64},
                  "Let no block of so many texels hold two charts, 4 for block compression; 0: off");
}

void declareSky(OptionTable& options, SceneArguments& a) {
  options.choice(
      "light-units", a.lightUnits, {"auto", "gltf", "blender", "blender-raw"},
      "Unit of the lamps of a glTF file: candela and lux as it says (gltf); 683 times watts, as Blender's "
      "exporter writes by default (blender) or plain watts (blender-raw), so that lamps and shining surfaces "
      "match; auto: by the program that wrote the file");
  options.color("sky-color", a.skyColor, {0.0f}, "Radiance of an even sky in nits, red green blue [none]");
  options.path("sky", a.sky, "Sky image: equirectangular .hdr or .exr [none]");
  options
      .number("sky-rotation", a.skyRotation, {},
              "Degrees by which the sky image is turned, counter-clockwise from above")
      .placeholder = "DEGREES";
  options.number("sky-strength", a.skyStrength, {0.0f}, "Factor on the sky image or colour");
  options.choice("sky-dome", a.skyDome, {"keep", "leave-out"},
                 "Meshes around the level that paint its sky: they keep sun and sky out (keep, with a warning), or are "
                 "as if they were not there (leave-out)");
}

void declareSkyAndSides(OptionTable& options, SceneArguments& a) {
  declareSky(options, a);
  options.choice("double-sided", a.doubleSided, {"lit", "wound"},
                 "Side of double-sided surfaces that gets the lightmap: their front as it is wound, but the back where "
                 "only that is lit (lit); always their front (wound)");
}

Expected<void> checkSky(const SceneArguments& a) {
  if (!a.sky.empty() && a.skyColor != Vec3(0.0f))
    return usageError("--sky and --sky-color: give one of them; --sky-strength scales either");
  return {};
}

Expected<void> checkAtlas(const AtlasOptions& atlas) {
  if (atlas.pageSize % 4 != 0)
    return usageError("--page-size: " + std::to_string(atlas.pageSize) + " is not a multiple of 4");
  return {};
}

/// Leaves out sky domes, or warns of those that keep light from outside away.
static void treatSkyDomes(Scene& scene, SkyDome treatment) {
  const bool lightFromOutside = !scene.environment.isBlack() ||
                                std::any_of(scene.lights.begin(), scene.lights.end(),
                                            [](const Light& light) { return light.type == LightType::Directional; });
  if (treatment == SkyDome::Keep && !lightFromOutside) return;
  for (const int index : findSkyDomes(scene)) {
    Instance& dome = scene.instances[static_cast<std::size_t>(index)];
    if (treatment == SkyDome::LeaveOut)
      dome.settings.casts = dome.settings.receives = false;
    else
      scene.report.warnings.push_back("'" + dome.name +
                                      "' is around all the rest like a sky dome and keeps sun and sky out; --sky-dome "
                                      "leave-out takes it away");
  }
}

Expected<Scene> loadSceneUnderSky(const SceneArguments& a) {
  const auto options = loadOptionsOf(a);
  if (!options) return options.error();
  auto scene = loadScene(a.scene, *options);
  if (!scene) return scene;
  if (auto settled = settleSsbumpForms(*scene); !settled) return settled.error();
  if (!a.sky.empty()) {
    auto sky = loadEnvironment(a.sky);
    if (!sky) return sky.error();
    scene->environment = std::move(*sky);
  } else {
    scene->environment.color = a.skyColor;
  }
  scene->environment.rotationDegrees = a.skyRotation;
  scene->environment.strength = a.skyStrength;
  treatSkyDomes(*scene, a.skyDome);
  if (!hasLight(*scene))
    scene->report.warnings.insert(scene->report.warnings.begin(),
                                  "the scene has no light and all will be black; give --sky-color or --sky");
  return scene;
}

Expected<Scene> loadLitScene(const SceneArguments& a, const Progress& progress) {
  auto scene = loadSceneUnderSky(a);
  if (!scene) return scene;
  if (a.doubleSided == DoubleSided::Wound || !hasLight(*scene)) return scene;
  const auto turned = turnToLight(*scene, progress);
  if (!turned) return turned.error();
  if (*turned > 0)
    scene->report.warnings.push_back(std::to_string(*turned) +
                                     " double-sided triangles face the dark: their backs get the lightmap "
                                     "(--double-sided wound: their fronts)");
  return scene;
}

bool hasLight(const Scene& scene) {
  const auto emits = [](const Material& m) { return m.emission != Vec3(0.0f) && !m.unlit; };
  const auto shines = [](const Light& l) {
    return l.intensity > 0.0f && l.color != Vec3(0.0f) && l.mode != LightMode::None;
  };
  return !scene.environment.isBlack() || std::any_of(scene.lights.begin(), scene.lights.end(), shines) ||
         std::any_of(scene.materials.begin(), scene.materials.end(), emits);
}

void printNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::fprintf(stderr, "lumel: %s\n", note.c_str());
}

void printWarnings(const std::vector<std::string>& warnings) {
  constexpr std::size_t kShown = 12;
  for (std::size_t i = 0; i < std::min(warnings.size(), kShown); ++i)
    std::fprintf(stderr, "lumel: warning: %s\n", warnings[i].c_str());
  if (warnings.size() > kShown)
    std::fprintf(stderr, "lumel: %zu more warnings; all are in bake.json\n", warnings.size() - kShown);
}

}  // namespace lumel
