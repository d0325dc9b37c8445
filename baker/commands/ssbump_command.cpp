// lumel ssbump: self-shadowed bump maps from height maps and meshes, and the ways from one map to another.
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "baker/commands/command.h"
#include "scene/base/parallel.h"
#include "scene/files/file_access.h"
#include "scene/files/file_set.h"
#include "scene/load/load_scene.h"
#include "ssbump/basis_file.h"
#include "ssbump/contact_sheet.h"
#include "ssbump/maps/convert.h"
#include "ssbump/mesh/mesh_source.h"
#include "ssbump/study.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using namespace ssbump;

enum class Bits { Automatic, Eight, Sixteen, Half, Float };
enum class BlockChoice { None, Bc1, Bc3 };
enum class FromWord { File, Squared, Linear, Mod2x, Normal };
enum class ToWord { Squared, Linear, Mod2x, Normal };

struct SsbumpArguments {
  fs::path input, output;
  // Heights
  std::string heightScale = "5%", channel;
  bool invert = false, wrap = true;
  int bilateral = 0;
  float bilateralThreshold = 0;
  fs::path normalMap;
  Green normalGreen = Green::Up;
  // Meshes
  fs::path low;
  int width = 512, height = 512, uvSet = 0, dilate = 8;
  float tileWidth = 0, tileHeight = 0, cage = 0;
  // Occlusion
  BackEnd method = BackEnd::Horizon;
  int azimuths = HorizonSettings{}.azimuths, rays = RaySettings{}.count, reach = 0, threads = 0;
  RaySampling sampling = RaySampling::Stratified;
  std::uint64_t seed = 1;
  LobeShape lobe = LobeShape::Hemisphere;
  float coneAngle = 120;
  std::string basis = "rnm";
  // Maps
  Convention convention = Convention::Squared;
  Hand hand = Hand::Right;
  Bits bits = Bits::Automatic;
  bool mips = false;
  MipFilter mipFilter = MipFilter::Box;
  BlockChoice blocks = BlockChoice::None;
  MapFiles save;
  fs::path albedo, mask, detail, contactSheet;
  float detailRepeats = 1;
  Green saveGreen = Green::Up;
  // Other work
  bool convert = false;
  FromWord from = FromWord::File;
  ToWord to = ToWord::Squared;
  Hand fromHand = Hand::Right;
  fs::path crossFade;
  float crossFadeAmount = 0.5f;
  fs::path study;
};

MapOptions mapOptions(const SsbumpArguments& a) {
  MapOptions options;
  if (a.bits != Bits::Automatic)
    options.format = a.bits == Bits::Eight     ? PixelFormat::U8
                     : a.bits == Bits::Sixteen ? PixelFormat::U16
                     : a.bits == Bits::Half    ? PixelFormat::Half
                                               : PixelFormat::Float;
  if (a.blocks != BlockChoice::None) options.ddsFormat = a.blocks == BlockChoice::Bc1 ? DdsFormat::Bc1 : DdsFormat::Bc3;
  options.mips = a.mips;
  options.mipFilter = a.mipFilter;
  options.wrap = a.wrap;
  return options;
}

Expected<MapSettings> mapSettings(const SsbumpArguments& a) {
  MapSettings maps;
  maps.files = a.save;
  maps.files.ssbump = a.output;
  maps.options = mapOptions(a);
  maps.encoding = {a.convention, a.hand};
  maps.green = a.saveGreen;
  maps.lobe = a.lobe;
  maps.coneOpeningDegrees = a.coneAngle;
  maps.albedo = a.albedo;
  maps.mask = a.mask;
  maps.detail = a.detail;
  maps.detailRepeats = a.detailRepeats;
  if (a.basis != "rnm") {
    auto basis = readBasis(a.basis);
    if (!basis) return basis.error();
    maps.basis = std::move(*basis);
  }
  return maps;
}

RaySettings raySettings(const SsbumpArguments& a) {
  return {a.rays, a.sampling, static_cast<std::uint32_t>(a.seed ^ (a.seed >> 32)), a.reach};
}

Expected<BakeSettings> bakeSettings(const SsbumpArguments& a) {
  BakeSettings settings;
  if (auto good = parseHeightScale(a.heightScale, settings.height); !good) return good.error();
  settings.height.channel = a.channel;
  settings.height.invert = a.invert;
  settings.height.wrap = a.wrap;
  settings.bilateralRadius = a.bilateral;
  settings.bilateralThresholdTexels = a.bilateralThreshold;
  settings.normalMap = a.normalMap;
  settings.normalMapGreen = a.normalGreen;
  settings.backEnd = a.method;
  settings.horizon.azimuths = a.azimuths;
  settings.horizon.reach = a.reach;
  settings.rays = raySettings(a);
  auto maps = mapSettings(a);
  if (!maps) return maps.error();
  settings.maps = std::move(*maps);
  return settings;
}

Expected<void> runConvert(const SsbumpArguments& a, const Progress& progress) {
  const auto conventionOf = [](int i) { return static_cast<Convention>(i); };
  ConvertSettings settings;
  if (a.from == FromWord::Normal)
    settings.from = MapForm{{}, a.normalGreen};
  else if (a.from != FromWord::File)
    settings.from = MapForm{Encoding{conventionOf(static_cast<int>(a.from) - 1), a.fromHand}, Green::Up};
  settings.to = a.to == ToWord::Normal ? MapForm{{}, a.saveGreen}
                                       : MapForm{Encoding{conventionOf(static_cast<int>(a.to)), a.hand}, Green::Up};
  settings.detail = a.detail;
  settings.detailRepeats = a.detailRepeats;
  settings.crossFade = a.crossFade;
  settings.crossFadeAmount = a.crossFadeAmount;
  settings.albedo = a.albedo;
  settings.options = mapOptions(a);
  return convertMap(a.input, a.output, settings, progress);
}

void tell(const CommandContext& context, const BakeReport& report) {
  if (context.quiet) return;
  std::fprintf(
      stderr,
      "%dx%d texels, heights %g to %g texels, occluders within %d texels; %.2f s read and prepared, %.2f s occlusion\n",
      report.width, report.height, static_cast<double>(report.lowestTexels), static_cast<double>(report.highestTexels),
      report.reachTexels, report.prepareSeconds, report.occlusionSeconds);
  for (const std::string& warning : report.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
}

Expected<void> runMesh(const SsbumpArguments& a, CommandContext& context) {
  auto maps = mapSettings(a);
  if (!maps) return maps.error();
  MeshSettings settings;
  settings.width = a.width;
  settings.height = a.height;
  settings.tileWidth = a.tileWidth;
  settings.tileHeight = a.tileHeight;
  settings.wrap = a.wrap;
  settings.uvSet = a.uvSet;
  settings.cage = a.cage;
  settings.dilate = a.dilate;
  settings.rays = raySettings(a);
  settings.maps = std::move(*maps);
  settings.maps.options.wrap = a.low.empty() && a.wrap;
  auto report = bakeMesh(a.input, a.low, settings, context.progress);
  if (!report) return report.error();
  tell(context, *report);
  return {};
}

Expected<void> runStudy(const SsbumpArguments& a, const BakeSettings& settings, CommandContext& context) {
  const auto lobes = rnmLobes(settings.maps.lobe, settings.maps.coneOpeningDegrees);
  auto baked = bakeInMemory(a.input, settings, lobes, context.progress);
  if (!baked) return baked.error();
  Image map = std::move(baked->occlusion);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) map.setRgb(x, y, map.rgb(x, y) * normalWeights(baked->normals.rgb(x, y)));
  return writeStudy(map, a.input.filename().string(), a.study, context.progress);
}

/// An option that would change nothing is a mistake: whoever gives it expects something else than would come.
Expected<void> checkUse(const SsbumpArguments& a, const OptionTable& options) {
  const bool convert = a.convert || !a.crossFade.empty(), mesh = !convert && isSceneFile(a.input),
             heights = !convert && !mesh, rays = mesh || (heights && a.method == BackEnd::Rays);
  const MapFiles& save = a.save;
  bool dds = false;
  for (const fs::path* file : {&a.output, &save.weights, &save.occlusion, &save.ambient, &save.normal, &save.recovered})
    dds = dds || lowerCaseExtension(*file) == ".dds";
  struct Rule {
    bool holds;
    const char* with;
    std::vector<const char*> options;
  };
  const std::vector<Rule> rules{
      {heights, "a height map", {"height-scale", "channel", "invert", "bilateral", "normal-map", "method", "reach"}},
      {heights, "a height map", {"contact-sheet", "study"}},
      {mesh, "a mesh (.gltf, .glb, .obj)", {"low", "width", "height", "tile-width", "tile-height"}},
      {mesh && !a.low.empty(), "--low", {"uv-set", "cage", "dilate"}},
      {!convert, "heights or a mesh; with --convert, --to says what to write", {"convention"}},
      {!convert, "heights or a mesh", {"lobe", "basis", "mask", "save-weights", "save-occlusion"}},
      {!convert, "heights or a mesh", {"save-ao", "save-normal", "save-recovered"}},
      {convert, "--convert", {"from", "from-hand", "to"}},
      {!a.crossFade.empty(), "--cross-fade", {"amount"}},
      {heights && !rays, "heights and --method horizon", {"azimuths"}},
      {rays, "--method rays or a mesh", {"rays", "sampling", "seed"}},
      {a.lobe == LobeShape::Cone, "--lobe cone", {"cone-angle"}},
      {a.bilateral > 0, "--bilateral", {"bilateral-threshold"}},
      {convert || !a.normalMap.empty(), "--normal-map or --convert", {"green"}},
      {!a.detail.empty(), "--detail", {"detail-repeats"}},
      {a.mips || dds, "--mips or a .dds file", {"mip-filter"}},
      {dds, "a .dds file", {"blocks"}},
  };
  for (const Rule& rule : rules)
    for (const char* name : rule.options)
      if (!rule.holds && options.isGiven(name)) return usageError(std::string("--") + name + " goes with " + rule.with);
  if ((a.tileWidth > 0) != (a.tileHeight > 0)) return usageError("--tile-width and --tile-height go together");
  return {};
}

/// What is written after the long work must be known to be possible before it.
Expected<void> checkPlaces(const SsbumpArguments& a) {
  if (a.output.empty() && a.study.empty() && a.contactSheet.empty())
    return usageError("-o FILE is missing: where the ssbump map goes (or --study DIR, --contact-sheet FILE)");
  const std::array inputs{a.input, a.normalMap, a.low, fs::path(a.basis), a.albedo, a.mask, a.detail, a.crossFade};
  const MapFiles& save = a.save;
  for (const fs::path& place :
       {a.output, save.weights, save.occlusion, save.ambient, save.normal, save.recovered, a.contactSheet})
    if (auto apart = checkNoInput(place, inputs); !apart) return apart;
  if (!a.study.empty())
    if (auto writable = checkWritable(a.study); !writable) return writable;
  if (!a.contactSheet.empty())
    if (auto place = FileSet().add(a.contactSheet); !place) return place.error();
  return {};
}

Expected<void> runSsbump(const SsbumpArguments& a, CommandContext& context) {
  if (auto good = checkUse(a, context.options); !good) return good;
  if (auto good = checkPlaces(a); !good) return good;
  const ThreadLimit limit(a.threads);
  if (a.convert || !a.crossFade.empty()) return runConvert(a, context.progress);
  if (isSceneFile(a.input)) return runMesh(a, context);
  auto settings = bakeSettings(a);
  if (!settings) return settings.error();
  if (!a.study.empty())
    if (auto done = runStudy(a, *settings, context); !done) return done;
  if (!a.contactSheet.empty())
    if (auto done = writeContactSheet(a.input, *settings, 512, a.contactSheet, context.progress); !done) return done;
  if (a.output.empty()) return {};
  auto report = bakeHeightMap(a.input, *settings, context.progress);
  if (!report) return report.error();
  tell(context, *report);
  return {};
}

void declareInput(OptionTable& o, SsbumpArguments& a) {
  Option& input = o.positionalPath(
      "input", a.input,
      "A height map (any image), a high-poly mesh (.gltf, .glb, .obj), or with --convert an ssbump or normal map");
  input.placeholder = "INPUT";
  o.path("output", a.output, "The ssbump map: .png, .tga, .tif, .exr or .dds").shortName = "o";
  o.group("Heights");
  Option& scale =
      o.text("height-scale", a.heightScale, "Height of a map value of 1: in texels (24) or of the width (5%)");
  scale.placeholder = "H";
  o.text("channel", a.channel, "Channel that holds the heights: a name, an index or luminance; else the first")
      .placeholder = "NAME";
  o.flag("invert", a.invert, "Dark is high");
  o.flag("wrap", a.wrap, "The map tiles (default); --no-wrap: it ends at its edges");
  o.integer("bilateral", a.bilateral, {0, 64},
            "Smooth stair-steps within this radius in texels, keeping edges; 0 = off");
  o.number("bilateral-threshold", a.bilateralThreshold, {0, 1e6f},
           "Height steps (texels) from this on are edges; 0 = as many of the file's steps as the radius");
  o.path("normal-map", a.normalMap, "Normals for the weights; else from the heights");
  o.choice("green", a.normalGreen, {"up", "down"}, "Green of a normal map that is read: up (OpenGL) or down (DirectX)");
  o.group("Meshes");
  o.path("low", a.low, "Low-poly mesh whose UVs and tangent frame the map gets; else a flat tile seen from +y");
  o.integer("width", a.width, {1, 16384}, "Width of the map");
  o.integer("height", a.height, {1, 16384}, "Height of the map");
  o.number("tile-width", a.tileWidth, {0, 1e9f}, "Flat tile about the origin, along x; 0 = the mesh's extent");
  o.number("tile-height", a.tileHeight, {0, 1e9f}, "Flat tile about the origin, along z; 0 = the mesh's extent");
  o.integer("uv-set", a.uvSet, {0, 15}, "UV set of the low-poly mesh");
  o.number("cage", a.cage, {0, 1e9f}, "How far off the low-poly surface to look; 0 = 5% of its diagonal");
  o.integer("dilate", a.dilate, {0, 256}, "Texels to grow beyond the low-poly charts");
}

void declareOcclusion(OptionTable& o, SsbumpArguments& a) {
  o.group("Occlusion");
  o.choice("method", a.method, {"horizon", "rays"},
           "horizon: exact horizons, noise-free; rays: Embree, for checks (meshes always use rays)");
  o.integer("azimuths", a.azimuths, {0, 1024},
            "Slices of the horizon method; 0: 48 for heights that span up to 32 texels, else 64");
  o.integer("rays", a.rays, {1, 1 << 20}, "Rays per texel");
  o.choice("sampling", a.sampling, {"random", "stratified", "sobol"}, "How rays are spread");
  o.integer("seed", a.seed, "Seed of the rays");
  o.integer("reach", a.reach, {0, 1 << 20}, "Texels beyond which nothing occludes; 0 = as far as the heights matter");
  o.choice("lobe", a.lobe, {"hemisphere", "cone"}, "Directions that count around each basis vector");
  o.number("cone-angle", a.coneAngle, {1, 180}, "Total opening of the cone in degrees");
  o.text("basis", a.basis, "rnm, or a text file with a unit vector x y z per line: one channel each").placeholder =
      "rnm|FILE";
  o.integer("threads", a.threads, {0, 1024}, "Threads; 0 = one per core. Results do not depend on it").defaultText =
      "0";
}

void declareMaps(OptionTable& o, SsbumpArguments& a) {
  o.group("Maps");
  o.choice("convention", a.convention, {"squared", "linear", "mod2x"},
           "Weights: flat is 1/3, 1/sqrt3 or 1/2 in each channel");
  o.choice("hand", a.hand, {"right", "left"}, "left swaps G and B, for engines whose bitangent points down");
  o.choice("bits", a.bits, {"auto", "8", "16", "half", "float"}, "Sample format; auto is 8, for .exr half");
  o.flag("mips", a.mips, "Full mip chains as NAME.mip1.EXT and on (.dds always holds its chain)");
  o.choice("mip-filter", a.mipFilter, {"box", "kaiser"}, "Filter of the mip chain");
  o.choice("blocks", a.blocks, {"none", "bc1", "bc3"}, "Block compression of .dds files");
  o.path("save-weights", a.save.weights, "Also the weights without occlusion");
  o.path("save-occlusion", a.save.occlusion, "Also the visibility around each basis vector");
  o.path("save-ao", a.save.ambient, "Also cosine-weighted ambient occlusion");
  o.path("save-normal", a.save.normal, "Also the normal map behind the weights");
  o.path("save-recovered", a.save.recovered, "Also the normal map that the ssbump map gives back");
  o.choice("save-green", a.saveGreen, {"up", "down"}, "Green of normal maps that are written");
  o.path("albedo", a.albedo, "Multiply by the luminance of this colour map");
  o.path("mask", a.mask, "First channel becomes the alpha channel, untouched (else the input's alpha)");
  o.path("detail", a.detail, "Blend in this ssbump map, evenly over the channels");
  o.number("detail-repeats", a.detailRepeats, {0.001f, 1000}, "Repeats of the detail map across the map");
  o.path("contact-sheet", a.contactSheet,
         "Also a picture: heights, normals, weights, with occlusion; recovered, AO, lit from right and top");
  o.group("Other work");
  o.flag("convert", a.convert, "INPUT is an ssbump or a normal map: write it as --to, --hand and --bits say");
  o.choice("from", a.from, {"file", "squared", "linear", "mod2x", "normal"},
           "What INPUT holds; file: what its metadata says");
  o.choice("from-hand", a.fromHand, {"right", "left"}, "Handedness of INPUT");
  o.choice("to", a.to, {"squared", "linear", "mod2x", "normal"}, "What to write");
  o.path("cross-fade", a.crossFade, "Mix INPUT with this map of the same size");
  o.number("amount", a.crossFadeAmount, {0, 1}, "Share of the second map in a cross-fade");
  o.path("study", a.study, "Compression study of the map into this folder: study.md, study.png").placeholder = "DIR";
}

}  // namespace

Command ssbumpCommand() {
  const auto arguments = std::make_shared<SsbumpArguments>();
  Command command;
  command.name = "ssbump";
  command.summary = "Make self-shadowed bump maps";
  command.examples =
      "A brick wall, 12 texels deep, and its ambient occlusion:\n"
      "  lumel ssbump brick_height.png -o brick_ssbump.png --height-scale 12 --save-ao brick_ao.png\n"
      "With a DirectX normal map beside it, as a BC1 texture for an engine that wants Valve's weights:\n"
      "  lumel ssbump h.png --normal-map n.png --green down -o s.dds --blocks bc1 --convention linear\n"
      "A sculpted tile and a high-poly prop:\n"
      "  lumel ssbump tile.glb -o tile.exr --width 1024 --height 1024\n"
      "  lumel ssbump prop_high.obj --low prop_low.obj -o prop.png\n"
      "Back to a normal map, and between conventions (maps of lumel say what they hold, others need --from):\n"
      "  lumel ssbump s.png --convert --to normal -o n.png\n"
      "  lumel ssbump valve.png --convert --from linear --from-hand left --to squared -o s.png\n"
      "Fine grain from a map that repeats eight times, and a wall half way to its broken state:\n"
      "  lumel ssbump h.png -o s.png --detail grain_ssbump.png --detail-repeats 8\n"
      "  lumel ssbump whole.png --cross-fade broken.png --amount 0.5 -o half.png\n"
      "What formats and mip levels cost on this map, as tables and pictures; a look at all maps at once:\n"
      "  lumel ssbump h.png --study study --contact-sheet sheet.png";
  declareInput(command.options, *arguments);
  declareOcclusion(command.options, *arguments);
  declareMaps(command.options, *arguments);
  command.run = [arguments](CommandContext& context) { return runSsbump(*arguments, context); };
  return command;
}

}  // namespace lumel
