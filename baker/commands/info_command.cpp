// lumel info: what a scene, a bake or an image holds.
#include <algorithm>
#include <memory>
#include <ostream>

#include "baker/commands/command.h"
#include "baker/commands/image_figures.h"
#include "baker/commands/scene_arguments.h"
#include "baker/commands/scene_figures.h"
#include "baker/commands/scene_lint.h"
#include "baker/files/read/baked_scene.h"
#include "lightmap/atlas/split_triangles.h"
#include "scene/images/image_io.h"
#include "scene/load/load_scene.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The heading of options that say nothing of bakes and images.
constexpr const char* kSceneOptions = "Scene";

struct InfoArguments : SceneArguments {  // `scene`: a scene, an image or a bake
  bool json = false;
  bool lint = false;
  SceneLintOptions lintOptions;
};

bool isScalar(const Json& value) { return !value.is_object() && !value.is_array(); }

std::string scalarText(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// "key value" lines, indented by depth; short lists of scalars on one line.
void printText(std::ostream& out, const Json& json, int depth = 0) {
  const std::string indent(static_cast<std::size_t>(depth) * 2, ' ');
  const auto printValue = [&](const std::string& label, const Json& value) {
    if (isScalar(value)) {
      out << indent << label << ": " << scalarText(value) << '\n';
    } else if (value.empty()) {
      out << indent << label << ": none\n";
    } else if (value.is_array() &&
               std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); })) {
      out << indent << label << ":";
      for (const Json& v : value) out << ' ' << scalarText(v);
      out << '\n';
    } else {
      out << indent << label << ":\n";
      printText(out, value, depth + 1);
    }
  };
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) printValue(key, value);
  } else {
    for (std::size_t i = 0; i < json.size(); ++i)
      if (isScalar(json[i]))
        out << indent << "- " << scalarText(json[i]) << '\n';
      else
        printValue(std::to_string(i), json[i]);
  }
}

Expected<Json> describeImage(const fs::path& file) {
  const auto loaded = readImage(file);
  if (!loaded) return loaded.error();
  Json channels = Json::object();
  const auto figures = channelFigures(loaded->image);
  for (std::size_t c = 0; c < figures.size(); ++c) {
    const std::string name = c < loaded->channelNames.size() ? loaded->channelNames[c] : std::to_string(c);
    channels[name] = {{"min", figures[c].least},
                      {"mean", figures[c].mean},
                      {"max", figures[c].most},
                      {"notANumber", figures[c].notANumber},
                      {"infinite", figures[c].infinite}};
  }
  return Json{{"kind", "image"},
              {"file", file.string()},
              {"format", loaded->format},
              {"width", loaded->image.width},
              {"height", loaded->image.height},
              {"bitsPerChannel", loaded->bitsPerChannel},
              {"float", loaded->isFloat},
              {"channels", std::move(channels)},
              {"metadata", loaded->metadata}};
}

Expected<Json> describeBakeFolder(const fs::path& dir) {
  auto json = readBakeJson(dir);
  if (!json) return json.error();
  // The lists of objects and charts are for programs; info gives the number of charts.
  json->erase("objects");
  json->erase("charts");
  Json out = {{"kind", "bake"}, {"folder", dir.string()}};
  out.update(*json);
  return out;
}

Expected<void> check(const InfoArguments& a, const OptionTable& options) {
  if (!isSceneFile(a.scene))
    for (const Option& option : options.all())
      if (option.group == kSceneOptions && option.isGiven)
        return usageError("--" + option.name + " is for scenes, and " + a.scene.string() + " is none");
  return checkSky(a);
}

Expected<Json> describe(const InfoArguments& a) {
  std::error_code ec;
  if (fs::is_directory(a.scene, ec)) return describeBakeFolder(a.scene);
  if (!isSceneFile(a.scene)) return describeImage(a.scene);
  auto scene = loadSceneUnderSky(a);
  if (!scene) return scene.error();
  const AtlasOptions& atlas = a.lintOptions.atlas;
  Json out = {{"kind", "scene"}, {"file", a.scene.string()}};
  if (a.lint || !a.lintOptions.pictures.empty()) {
    splitLongTriangles(*scene, atlas);
    const auto lint = lintScene(*scene, a.lintOptions);
    if (!lint) return lint.error();
    // Text shows the lines alone: they hold all the findings.
    out["lint"] = a.json ? *lint : lint->at("lines");
    return out;
  }
  out.update(describeScene(*scene, atlas));
  if (const SplitReport split = splitLongTriangles(*scene, atlas); split.triangles > 0)
    out["trianglesLongerThanAPage"] =
        std::to_string(split.triangles) + ", they are split into " + std::to_string(split.pieces);
  return out;
}

}  // namespace

Command infoCommand() {
  Command command;
  const auto arguments = std::make_shared<InfoArguments>();
  InfoArguments& a = *arguments;
  command.name = "info";
  command.summary = "What a scene, a bake folder or an image holds";
  command.examples =
      "Examples:\n"
      "  lumel info level.gltf --texels-per-meter 16\n"
      "      meshes, materials, lights, warnings, and how many texels and how much memory such a bake would take\n"
      "  lumel info level.gltf --lint --charts out/charts\n"
      "      what is wrong or wasteful in the lightmap UVs, and pictures of them\n"
      "  lumel info out/level\n"
      "      settings, conventions, pages and figures of a bake\n"
      "  lumel info out/level/lightmap-0-flat.exr --json";
  command.options.positionalPath("file", a.scene, "Scene (.gltf, .glb, .obj), folder of a bake, or image").placeholder =
      "FILE|DIR";
  command.options.flag("json", a.json, "Print JSON");
  command.options.group(kSceneOptions);
  command.options.number("texels-per-meter", a.lintOptions.atlas.texelsPerMeter, {0.0f, 1e6f},
                         "Density for the estimate; 0: the density that fills one page");
  command.options.integer("page-size", a.lintOptions.atlas.pageSize, {4, 16384},
                          "Texels on a side of a page, for the estimate");
  command.options.flag("lint", a.lint,
                       "Check the lightmap UVs that a bake would use: overlaps, flips, tiny charts, ...");
  command.options.choice("uv", a.lintOptions.atlas.uvSource, {"auto", "scene", "object", "generate"},
                         "Lightmap UVs to look at, as in lumel bake");
  command.options.integer("padding", a.lintOptions.atlas.padding, {0, 64}, "Texels between charts");
  command.options.path("charts", a.lintOptions.pictures, "Write a picture of each page's charts (PNG) to this folder")
      .placeholder = "DIR";
  declareSky(command.options, a);
  declareOutsidePaths(command.options, a);
  declareSsbump(command.options, a);
  command.run = [arguments](CommandContext& context) -> Expected<void> {
    if (auto checked = check(*arguments, context.options); !checked) return checked;
    const auto json = describe(*arguments);
    if (!json) return json.error();
    if (arguments->json)
      context.out << json->dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    else
      printText(context.out, *json);
    return {};
  };
  return command;
}

}  // namespace lumel
