// lumel export: a bake's maps as textures for GPUs, or everything that an engine needs.
#include <algorithm>
#include <cstdio>
#include <memory>

#include "baker/commands/command.h"
#include "baker/export/engine_export.h"
#include "baker/export/export_folder.h"
#include "baker/export/map_export.h"
#include "baker/export/page_geometry.h"
#include "baker/files/names/bake_format.h"
#include "baker/files/names/conventions.h"
#include "baker/files/read/baked_scene.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ExportArguments {
  fs::path bake, output;
  MapContainer format = MapContainer::Ktx2;
  TexelFormat texels = TexelFormat::Bc6h;
  std::string encoding;
  std::optional<float> rgbmRange;
  bool flatOnly = false, mips = true;
  Engine engine = Engine::Three;
  bool keepLights = false;
  int threads = 0;
};

void declareOptions(OptionTable& o, ExportArguments& a) {
  o.positionalPath("bake", a.bake, "Folder that lumel bake -o wrote").placeholder = "DIR";
  Option& output = o.path("output", a.output, "Folder for the export");
  output.shortName = "o";
  output.required = true;
  output.placeholder = "OUT";
  o.group("Maps");
  o.choice("format", a.format, {"exr-half", "png-rgbm", "ktx2", "dds"}, "Files of the maps");
  o.choice("texels", a.texels, {"half", "rgb9e5", "bc6h"},
           "Texels of ktx2 and dds: 64, 32 or 8 bits each. Maps that may be negative take signed bc6h or half");
  o.text("encoding", a.encoding, "Which encoding's maps; without it the bake's first").placeholder = "NAME";
  o.flag("flat-only", a.flatOnly, "The flat map alone, without the encoding's maps");
  o.flag("mips", a.mips, "Mip levels in ktx2 and dds that keep charts apart (--no-mips: none)").defaultText = "on";
  o.optionalNumber("rgbm-range", a.rgbmRange, {1e-6f, 1e9f},
                   "Largest value that png-rgbm holds; without it that of the maps")
      .placeholder = "X";
  o.group("Engines");
  o.choice("for", a.engine, {"three", "godot", "bevy", "unity"},
           "Everything that an engine needs, with a README of the steps: scene, maps in its formats and units, tables, "
           "loader; --format is its own then")
      .defaultText = "";
  o.flag("keep-lights", a.keepLights, "Leave lamps whose light is in the maps in the engine's scene");
  o.group("General");
  o.integer("threads", a.threads, {0, 4096}, "Threads; 0: one per core");
}

/// Says what was written, and how far it is from the bake.
void printResult(const ExportArguments& a, std::size_t files, const Json& description) {
  double worst = 0.0;
  std::size_t bytes = 0;
  for (const Json& map : description.at("maps")) {
    std::error_code ec;
    bytes += fs::file_size(a.output / map.at("file").get<std::string>(), ec);
    const Json error = map.value("relativeRmse", Json());
    if (error.is_number()) worst = std::max(worst, error.get<double>());
  }
  std::fprintf(stderr, "%s: %zu files, maps of %.1f MiB", a.output.c_str(), files,
               static_cast<double>(bytes) / 1048576.0);
  if (worst > 0.0) std::fprintf(stderr, ", at most %.2g%% (RMS) from the bake", 100.0 * worst);
  std::fputs("\n", stderr);
}

Expected<Json> describeMaps(const ExportArguments& a, const Json& bakeJson, ExportFolder& folder, Progress& progress) {
  const auto baked = readBake(a.bake, {.encoding = a.encoding, .flat = true, .aux = true});
  if (!baked) return baked.error();
  const MapExportOptions options{a.format, a.texels, a.rgbmRange, a.mips, a.flatOnly};
  const auto maps = exportMaps(*baked, chartTexels(*baked, bakeJson), options, folder, progress);
  if (!maps) return maps.error();
  Json description = {{"encoding", describeEncoding(*baked->encoding)}};
  description["conventions"] = describeConventions(*baked->encoding);
  description["maps"] = *maps;
  return description;
}

/// Options that say nothing to what was asked for.
Expected<void> checkOptions(const ExportArguments& a, const OptionTable& options) {
  const bool isEngine = options.isGiven("for");
  if (isEngine && a.engine != Engine::Three && options.isGiven("encoding"))
    return usageError("--encoding: is for textures and three; other engines take what they can read");
  const bool isTexture = a.format == MapContainer::Ktx2 || a.format == MapContainer::Dds;
  for (const char* name : {"texels", "mips"})
    if (!isEngine && !isTexture && options.isGiven(name))
      return usageError(std::string("--") + name + ": is for --format ktx2 and dds");
  if (!isEngine && a.format != MapContainer::PngRgbm && options.isGiven("rgbm-range"))
    return usageError("--rgbm-range: is for --format png-rgbm");
  if (!isEngine && a.flatOnly && options.isGiven("encoding"))
    return usageError("--encoding: says nothing to --flat-only, whose map is the same for all; leave it out");
  for (const char* name : {"format", "rgbm-range", "flat-only", "mips"})
    if (isEngine && options.isGiven(name))
      return usageError(std::string("--") + name + ": the engine's own is written with --for; leave it out");
  if (!isEngine && options.isGiven("keep-lights"))
    return usageError("--keep-lights: is for scenes, so give --for, too");
  return {};
}

Expected<void> runExport(const ExportArguments& a, CommandContext& context) {
  if (auto done = checkOptions(a, context.options); !done) return done;
  const ThreadLimit limit(a.threads);
  FileSet::recover(a.bake);
  const auto bakeJson = readBakeJson(a.bake);
  if (!bakeJson) return bakeJson.error();
  const auto encoding = encodingOf(*bakeJson, (a.bake / "bake.json").string(), a.encoding);
  if (!encoding) return encoding.error();
  auto folder = ExportFolder::open(a.output);
  if (!folder) return folder.error();
  EngineExportOptions engine{a.engine, {}, a.encoding, a.keepLights};
  if (context.options.isGiven("texels")) engine.texels = a.texels;
  auto description = context.options.isGiven("for") ? exportFor(a.bake, *bakeJson, engine, *folder, context.progress)
                                                    : describeMaps(a, *bakeJson, *folder, context.progress);
  if (!description) return description.error();
  if (auto done = folder->commit(*description); !done) return done;
  if (!context.quiet) printResult(a, folder->fileCount(), *description);
  return {};
}

}  // namespace

Command exportCommand() {
  Command command;
  const auto arguments = std::make_shared<ExportArguments>();
  command.name = "export";
  command.summary = "Write a bake for GPUs and engines";
  command.takesConfig = true;
  command.examples =
      "Examples:\n"
      "  lumel export out/level -o out/textures --format ktx2\n"
      "      BC6H with mip levels, 8 bits a texel; bake with --block-align 4 so that charts share no block\n"
      "  lumel export out/level -o out/textures --format dds --texels rgb9e5\n"
      "  lumel export out/level -o out/textures --format png-rgbm --flat-only --rgbm-range 64\n"
      "  lumel export out/level -o game/level --for godot\n"
      "      bake with --encoding rnm,sh1 for directional lightmaps in Godot and Unity\n"
      "export.json in the folder says what each file holds, and how far it is from the bake.";
  declareOptions(command.options, *arguments);
  command.run = [arguments](CommandContext& context) { return runExport(*arguments, context); };
  return command;
}

}  // namespace lumel
