// lumel render: a still of a bake.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <memory>

#include "baker/commands/command.h"
#include "baker/files/names/file_names.h"
#include "baker/files/names/version.h"
#include "baker/stills/compositor.h"
#include "baker/stills/lamps.h"
#include "baker/stills/placed_object.h"
#include "baker/stills/sheet.h"
#include "baker/stills/tone_map.h"
#include "baker/stills/viewpoint.h"
#include "scene/base/parallel.h"
#include "scene/base/split_text.h"
#include "scene/files/file_access.h"
#include "scene/files/file_set.h"
#include "scene/images/image_io.h"
#include "scene/load/load_scene.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultWidth = 1280;
constexpr int kDefaultHeight = 720;

struct RenderArguments {
  fs::path bake;
  fs::path output;
  std::string camera;
  std::optional<Vec3> position;
  std::optional<Vec3> lookAt;
  float fovDegrees = 0.0f;
  int width = 0;
  int height = 0;
  int samplesPerPixel = 16;
  std::string modes = std::string(shadings().front().name);  // separated by commas
  std::string lamps;
  fs::path object;
  std::optional<Vec3> at;
  std::string encoding;
  std::optional<float> exposure;
  ToneMap toneMap = ToneMap::Aces;
  int threads = 0;
};

void declareOptions(OptionTable& options, RenderArguments& a) {
  options.positionalPath("bake", a.bake, "Folder that lumel bake -o wrote").placeholder = "DIR";
  options.group("Picture");
  Option& output = options.path("output", a.output, "Picture to write: .png (tone-mapped) or .exr (linear, unexposed)");
  output.shortName = "o";
  output.required = true;
  options.integer("width", a.width, {0, 16384}, "Pixels").defaultText = std::to_string(kDefaultWidth);
  options.integer("height", a.height, {0, 16384}, "Pixels").defaultText = "by the camera's aspect, else 16:9";
  options.integer("spp", a.samplesPerPixel, {1, 4096}, "Rays per pixel, for smooth edges");
  options
      .text(
          "mode", a.modes,
          "What to show; several, separated by commas, make a sheet of panels with their names. " + describeShadings())
      .placeholder = "NAME,...";
  options.text("encoding", a.encoding, "Which of the bake's encodings is decoded").defaultText = "its first";
  options.find("encoding")->placeholder = "NAME";
  options
      .text("light", a.lamps,
            "Lights that are not in the bake, with shadows, separated by semicolons: point:X,Y,Z:CANDELA, "
            "spot:X,Y,Z:DX,DY,DZ:CANDELA:DEGREES, spot:camera:CANDELA:DEGREES (a flashlight), sun:DX,DY,DZ:LUX; each "
            "may end in :R,G,B")
      .placeholder = "LIGHT;...";
  options.find("light")->defaultText = "none";
  options
      .path("object", a.object,
            "Model to put into the picture, lit by the bake's light volume where it stands, else by the mean light")
      .placeholder = "FILE";
  options.find("object")->defaultText = "none";
  options.vector("at", a.at, "Where the model's origin stands, in the scene's metres [0 0 0]");
  options
      .optionalNumber("exposure", a.exposure, {-64.0f, 64.0f}, "Stops of exposure for PNG; 0 shows radiance 1 as white")
      .defaultText = "by the picture's brightness";
  options.choice("tonemap", a.toneMap, {"aces", "linear"}, "Curve for PNG");
  options.group("Camera");
  options.text("camera", a.camera, "Name or number (from 0) of a camera of the scene, or auto").defaultText =
      "the scene's first, else auto";
  options.find("camera")->placeholder = "NAME|N|auto";
  options.vector("camera-position", a.position, "Position of a camera of your own, in the scene's metres");
  options.vector("look-at", a.lookAt, "Where it looks [middle of the scene]");
  options.number("fov", a.fovDegrees, {0.0f, 170.0f}, "Vertical field of view in degrees; 0: the camera's")
      .placeholder = "DEGREES";
  options.group("General");
  options.integer("threads", a.threads, {0, 1024}, "Threads to use, without influence on the result; 0: one per core");
}

Expected<std::vector<const Shading*>> modesOf(const RenderArguments& a) {
  std::vector<const Shading*> modes;
  for (const std::string& name : splitText(a.modes, ',')) {
    modes.push_back(findShading(name));
    if (!modes.back()) {
      std::string known;
      for (const Shading& shading : shadings()) known += (known.empty() ? "" : ", ") + std::string(shading.name);
      return usageError("--mode: '" + name + "' is not one of " + known);
    }
  }
  return modes;
}

Expected<void> check(const RenderArguments& a) {
  const std::string extension = lowerCaseExtension(a.output);
  if (extension != ".png" && extension != ".exr")
    return usageError("--output: " + a.output.string() + ": pictures are .png or .exr");
  const auto modes = modesOf(a);
  if (!modes) return modes.error();
  if (extension == ".exr" && modes->size() > 1)
    return usageError("--mode: several modes make a sheet, which is a .png; give one for .exr");
  if (extension == ".exr" && a.exposure)
    return usageError("--exposure: .exr pictures are linear and unexposed; give .png");
  if (a.at && a.object.empty()) return usageError("--at needs --object");
  if (a.lookAt && !a.position) return usageError("--look-at needs --camera-position");
  if (a.position && a.lookAt && *a.position == *a.lookAt)
    return usageError("--look-at: the same point as --camera-position; it has no direction");
  return {};
}

Expected<Camera> findCamera(const Scene& scene, const std::string& wanted) {
  const auto& cameras = scene.cameras;
  for (const Camera& camera : cameras)
    if (camera.name == wanted) return camera;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
  if (error == std::errc() && end == wanted.data() + wanted.size() && index < cameras.size()) return cameras[index];
  std::string known;
  for (const Camera& camera : cameras) known += (known.empty() ? "" : ", ") + ("'" + camera.name + "'");
  return usageError("--camera: no camera '" + wanted + "'; the scene has " +
                    (known.empty() ? "none; use auto" : known));
}

Expected<Camera> chooseCamera(const RenderArguments& a, const BakedScene& baked, const Compositor& compositor) {
  constexpr float kOwnFov = 0.95f;
  constexpr float kRadians = kPi / 180.0f;
  Camera camera;
  if (a.position) {
    Vec3 target = a.lookAt.value_or(0.5f * (compositor.boundsMin() + compositor.boundsMax()));
    if (target == *a.position) target.z -= 1.0f;
    camera = cameraLookingAt(*a.position, target, kOwnFov);
  } else if (a.camera == "auto" || (a.camera.empty() && baked.scene.cameras.empty())) {
    const float aspect = a.width > 0 && a.height > 0 ? static_cast<float>(a.width) / static_cast<float>(a.height)
                                                     : static_cast<float>(kDefaultWidth) / kDefaultHeight;
    camera = chooseViewpoint(compositor, aspect);
  } else if (a.camera.empty()) {
    camera = baked.scene.cameras.front();
  } else {
    auto found = findCamera(baked.scene, a.camera);
    if (!found) return found;
    camera = *found;
  }
  if (a.fovDegrees > 0.0f) camera.yFov = a.fovDegrees * kRadians;
  return camera;
}

RenderOptions resolve(const RenderArguments& a, const Camera& camera) {
  const float aspect = camera.aspect > 0.0f ? camera.aspect : static_cast<float>(kDefaultWidth) / kDefaultHeight;
  const auto pixels = [](float v) { return std::clamp(static_cast<int>(std::lround(v)), 1, 16384); };
  RenderOptions options;
  options.samplesPerPixel = a.samplesPerPixel;
  options.width = a.width > 0 ? a.width : a.height > 0 ? pixels(static_cast<float>(a.height) * aspect) : kDefaultWidth;
  options.height = a.height > 0 ? a.height : pixels(static_cast<float>(options.width) / aspect);
  return options;
}

std::string describe(const Camera& camera) {
  const Vec3 p(camera.worldFromCamera[3]);
  const Vec3 forward = -glm::normalize(Vec3(camera.worldFromCamera[2]));
  char text[200];
  std::snprintf(text, sizeof text, "%s at (%.4g, %.4g, %.4g) towards (%.3g, %.3g, %.3g)", camera.name.c_str(),
                static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z),
                static_cast<double>(forward.x), static_cast<double>(forward.y), static_cast<double>(forward.z));
  return text;
}

/// The still as an 8-bit picture shows it, sRGB-encoded.
Image pictureOf(const Still& still, const Shading& shading, float exposure, ToneMap curve) {
  switch (shading.shown) {
    case Shown::Light:
      return toneMap(still.radiance, exposure, curve);
    case Shown::Color:
      return toneMap(still.radiance, 0.0f, ToneMap::Linear);
    case Shown::Number:
      return numberPicture(still, std::string(shading.unit));
    case Shown::Data:
      break;
  }
  return still.radiance;
}

Expected<void> writePicture(const RenderArguments& a, const Image& picture, const std::string& camera) {
  WriteImageOptions options;
  options.metadata = {{"lumel:version", kVersion}, {"lumel:camera", camera}};
  if (lowerCaseExtension(a.output) == ".exr")
    options.metadata["lumel:units"] = "linear Rec. 709 radiance in nits, unexposed";
  else
    options.format = PixelFormat::U8;
  return writeImage(a.output, picture, options);
}

void printResult(const RenderArguments& a, const Image& picture, const std::string& camera,
                 std::optional<float> exposure) {
  std::fprintf(stderr, "%s: %d x %d, camera %s", a.output.c_str(), picture.width, picture.height, camera.c_str());
  if (lowerCaseExtension(a.output) == ".exr")
    std::fputs(", unexposed\n", stderr);
  else
    std::fprintf(stderr, ", exposure %.2f EV\n", static_cast<double>(exposure.value_or(0.0f)));
}

Expected<void> checkOutput(const RenderArguments& a) {
  if (isBakeFile(a.output.filename().string()))
    if (auto apart = checkNoInput(a.output, std::array{a.bake / a.output.filename()}); !apart) return apart;
  const fs::path folder = a.output.has_parent_path() ? a.output.parent_path() : fs::path(".");
  std::error_code ec;
  fs::create_directories(folder, ec);
  return checkWritable(folder);
}

Expected<void> runRender(const RenderArguments& a, CommandContext& context) {
  if (auto checked = check(a); !checked) return checked;
  if (auto checked = checkOutput(a); !checked) return checked;
  const ThreadLimit limit(a.threads);
  const std::vector<const Shading*> modes = *modesOf(a);
  auto baked = readBake(a.bake, {.encoding = a.encoding, .flat = true, .aux = true, .volumes = true});
  if (!baked) return baked.error();
  if (!a.object.empty()) {
    const auto object = loadScene(a.object);
    if (!object) return object.error();
    placeObject(baked->scene, *object, a.at.value_or(Vec3(0.0f)));
  }
  const auto compositor = Compositor::make(*baked);
  if (!compositor) return compositor.error();
  if (!context.quiet)
    for (const std::string& warning : compositor->warnings())
      std::fprintf(stderr, "lumel: warning: %s\n", warning.c_str());
  if (context.progress.cancelled()) return interrupted();

  const auto camera = chooseCamera(a, *baked, *compositor);
  if (!camera) return camera.error();
  auto lamps = parseLamps(a.lamps, *camera);
  if (!lamps) return lamps.error();
  RenderOptions options = resolve(a, *camera);
  options.lamps = *std::move(lamps);
  // All panels of a sheet share one exposure, that of the first that shows light, so that they can be compared.
  std::optional<float> exposure = a.exposure;
  std::vector<Panel> panels;
  for (const Shading* mode : modes) {
    options.shading = mode;
    const auto still = compositor->render(*camera, options, context.progress);
    if (!still) return still.error();
    if (lowerCaseExtension(a.output) == ".exr") {
      panels.push_back({"", still->radiance});
      break;
    }
    if (!exposure && mode->shown == Shown::Light) exposure = autoExposure(still->radiance, still->lit);
    panels.push_back({std::string(mode->name), pictureOf(*still, *mode, exposure.value_or(0.0f), a.toneMap)});
  }
  const Image picture = panels.size() == 1 ? std::move(panels.front().picture) : sheetOf(panels);
  if (auto written = writePicture(a, picture, describe(*camera)); !written) return written;
  if (!context.quiet) printResult(a, picture, describe(*camera), exposure);
  return {};
}

}  // namespace

Command renderCommand() {
  Command command;
  const auto arguments = std::make_shared<RenderArguments>();
  command.name = "render";
  command.summary = "Render a still of a bake as a game would show it";
  command.takesConfig = true;
  command.examples =
      "Examples:\n"
      "  lumel render out/level -o out/level.png\n"
      "      the scene's first camera, or a viewpoint found by looking around\n"
      "  lumel render out/level -o light.png --mode lightmap\n"
      "      the light alone, where leaks and seams show best\n"
      "  lumel render out/level -o sheet.png --mode albedo,flat,normal-mapped,ssbump --light spot:camera:300:25\n"
      "      four panels with their names, under a flashlight at the eye\n"
      "  lumel render out/level -o still.exr --camera-position 0 1.7 4 --look-at 0 1 0 --width 1920";
  declareOptions(command.options, *arguments);
  command.run = [arguments](CommandContext& context) { return runRender(*arguments, context); };
  return command;
}

}  // namespace lumel
