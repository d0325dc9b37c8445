// lumel bake: from a scene file to the files of a bake.
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "baker/bake/bake.h"
#include "baker/bake/finish.h"
#include "baker/bake/gather_session.h"
#include "baker/bake/light_volumes.h"
#include "baker/bake/quality.h"
#include "baker/bake/shadow_masks.h"
#include "baker/commands/command.h"
#include "baker/commands/encoding_list.h"
#include "baker/commands/scene_arguments.h"
#include "baker/commands/stage_clock.h"
#include "baker/commands/volume_arguments.h"
#include "baker/files/names/file_names.h"
#include "baker/files/read/earlier_layout.h"
#include "baker/files/write/bake_files.h"
#include "baker/light/lit_scene.h"
#include "lightmap/atlas/atlas.h"
#include "lightmap/atlas/split_triangles.h"
#include "lightmap/texels/texels.h"
#include "scene/base/half.h"
#include "scene/base/parallel.h"
#include "scene/base/process_memory.h"
#include "scene/base/split_text.h"
#include "scene/files/file_set.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr int kDilateByPadding = -1;

/// Auto: for the gather. Path tracing is the reference and stays as it is.
enum class Denoise { Auto, On, Off };
/// Auto: from preview upwards, for the gather.
enum class Audit { Auto, On, Off };
/// Least samples where a target error is given and --samples is not: the first at which an error is known well enough.
constexpr int kLeastSamples = 32;

struct BakeArguments : SceneArguments {
  fs::path output;
  AtlasOptions atlas;
  fs::path layoutFrom;
  std::string objects;  // names, comma between them; empty: all
  BakeOptions bake;
  Denoise denoise = Denoise::Auto;
  Audit audit = Audit::Auto;
  float auditFailAbove = 0.0f;  // 0: never
  int dilate = kDilateByPadding;
  bool half = false;
  bool flatten = false;
  bool shadowMasks = false;
  VolumeArguments volumes;
  bool strict = false;
  int threads = 0;
  Quality quality = Quality::Production;
  int samples = 0;  // 0: as the quality has it
  Projection projection = Projection::Flat;
  std::string encodings = "rnm";  // names, comma between them
};

void declareLightOptions(OptionTable& options, BakeArguments& a) {
  options.group("Light");
  options.choice("integrator", a.bake.integrator, {"gather", "path"},
                 "Light from other texels (gather), or every path to its end: unbiased and slow (path)");
  options.choice("quality", a.quality, {"draft", "preview", "production"}, "16, 64 or 256 samples");
  options.integer("samples", a.samples, {1, 1 << 24}, "Gather rays per texel, at most; with --target-error the least")
      .defaultText = "by --quality; 32 with --target-error";
  options.choice("adaptive", a.bake.adaptive, {"off", "on"},
                 "After 32 samples leave out texels whose error is too small to be seen beside that of others; off: "
                 "the same number everywhere");
  options.share("target-error", a.bake.targetError, {0.0f, 0.5f},
                "Sample each part of a page until the relative standard error of its light is so small (1% or 0.01); "
                "done where 95% of the texels are. Texels darker than a tenth of the place that lights them count as "
                "so bright. 0: off, the same number of rays everywhere");
  options.integer("max-samples", a.bake.maxSamples, {1, 1 << 24},
                  "Most gather rays per texel with --target-error, whether it is met or not");
  options.number("time-budget", a.bake.timeBudgetSeconds, {0.0f},
                 "Begin no pass that would end later than so many seconds of gathering; 0: none. The result then "
                 "depends on the machine");
  options.integerOrWord("bounces", a.bake.bounces, {0, 1024}, "all", kAllBounces,
                        "Indirect bounces; 0: direct light only, all: as many as matter");
  options.flag("indirect-only", a.bake.indirectOnly,
               "Leave out light that comes straight from lights, shining surfaces and the sky: the program that shows "
               "the scene adds it");
  options.flag("shadow-masks", a.shadowMasks,
               "Also bake how much of up to four lamps marked by extras.lumel.light.shadow_mask each texel sees, into "
               "one RGBA map per page");
  declareSkyAndSides(options, a);
  options
      .text("encoding", a.encodings,
            "What is stored of the light, names with commas between, all from the same rays; readers take the first "
            "unless told otherwise. The flat map is always stored. Below is what each is for")
      .placeholder = "NAME,...";
  options.choice(
      "projection", a.projection, {"raw", "flat", "fit", "signed"},
      "How light is spread over the maps of rnm. flat: exact on flat normals, for gentle normal maps; under "
      "grazing light a bump that faces it gets .27 where .50 is right. raw: clamped dots, .48 there, but .58 "
      "to .79 of the light of flat normals. fit: least squares for normals within 30 degrees, exact on flat "
      "ones. signed: plain dots, maps may be negative, to be decoded with linear weights. Other encodings are exact on "
      "flat normals, but for raw, plain bands; fit makes sh1 the nearest to irradiance for readers of L0 + N.L");
  options.choice(
      "audit", a.audit, {"auto", "on", "off"},
      "Path trace texels drawn at random and compare them with the finished maps: finds light that is wrong, "
      "which the standard error does not know; auto: with --integrator gather from 64 samples on");
  options.share("audit-fail-above", a.auditFailAbove, {0.0f, 1e6f},
                "End with exit code 4, result written, where the audit finds light off by more (3% or 0.03). 0: never");
  options.integer("seed", a.bake.seed, "Seed of the sampling; the same seed gives the same bytes");
}

void declareOptions(OptionTable& options, BakeArguments& a) {
  declareScene(options, a);
  options.group("Files");
  Option& output =
      options.path("output", a.output, "Folder for the result; an older result is replaced when the new one is whole");
  output.shortName = "o";
  output.placeholder = "DIR";
  output.required = true;
  options.flag("half", a.half, "Write half floats: half the size, values up to 65504");
  options.flag("flatten", a.flatten,
               "Write scene.glb in world space: a mesh of its own for each object, UVs of pages, no transforms");
  options.choice("denoise", a.denoise, {"auto", "on", "off"},
                 "Average texels with those around them that agree within their noise; auto: with --integrator gather");
  options.choice(
      "seams", a.bake.seams, {"off", "on"},
      "Make lookups from both sides agree where charts or objects meet and light goes on: for levels made of "
      "tiles; where charts are a few texels wide their borders get less exact. Nothing with --dilate 0");
  options.integer("dilate", a.dilate, {0, 1024}, "Rings of texels grown around charts; 0: none").defaultText =
      "half of --padding";
  declareOutsidePaths(options, a);
  declareSsbump(options, a);
  declareAtlasOptions(options, a.atlas);
  options
      .path("layout-from", a.layoutFrom,
            "Folder of an earlier bake, may be the output's: unchanged charts stay where they are in it [none]")
      .placeholder = "DIR";
  options
      .text("objects", a.objects,
            "Bake these objects alone, names with commas between, NAME* for all that begin so; the others block and "
            "bounce light [all]")
      .placeholder = "NAME,...";
  declareLightOptions(options, a);
  declareVolumes(options, a.volumes);
  options.group("General");
  options.flag("strict", a.strict, "Exit with 4 if there was any warning; the result is written all the same");
  options.integer("threads", a.threads, {0, 1024}, "Threads to use, without influence on the result; 0: one per core");
}

/// Leaves a lightmap to the objects on the list alone.
Expected<void> keepObjects(const std::string& list, Scene& scene) {
  if (list.empty()) return {};
  const auto matches = [](const std::string& pattern, const std::string& name) {
    return !pattern.empty() && pattern.back() == '*'
               ? name.compare(0, pattern.size() - 1, pattern, 0, pattern.size() - 1) == 0
               : name == pattern;
  };
  std::vector<bool> wanted(scene.instances.size(), false);
  for (const std::string& pattern : splitText(list, ',')) {
    bool found = false;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
      if (!matches(pattern, scene.instances[i].name)) continue;
      wanted[i] = found = true;
    }
    if (!found) return usageError("--objects: no object is named '" + pattern + "'; they are the names of nodes");
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i)
    scene.instances[i].settings.receives = scene.instances[i].settings.receives && wanted[i];
  return {};
}

/// Warns of light that halfs cannot hold, where that is known before the bake: suns and skies as a facing surface
/// stores them.
void warnOfHalf(Scene& scene) {
  const auto warn = [&](const std::string& what, float stored) {
    if (stored <= kMostHalf) return;
    char text[64];
    std::snprintf(text, sizeof text, " alone brings %.3g, and --half ends at 65504", static_cast<double>(stored));
    scene.report.warnings.push_back(what + text + "; what is beyond is cut");
  };
  const auto peak = [](const Vec3& c) { return std::max({c.x, c.y, c.z}); };
  for (const Light& light : scene.lights)
    if (light.type == LightType::Directional)
      warn("light '" + light.name + "'", light.intensity * peak(light.color) * kInvPi);
  if (scene.environment.image.empty()) warn("the sky", scene.environment.strength * peak(scene.environment.color));
}

/// What the options cannot check one by one.
Expected<void> check(const BakeArguments& a, const OptionTable& options) {
  if (auto checked = checkAtlas(a.atlas); !checked) return checked;
  if (a.bake.integrator == Integrator::Path && (a.bake.targetError > 0.0f || a.bake.timeBudgetSeconds > 0.0f))
    return usageError("--target-error and --time-budget work with --integrator gather alone; give --samples");
  if (options.isGiven("max-samples") && !(a.bake.targetError > 0.0f))
    return usageError("--max-samples goes with --target-error; without one --samples is the number");
  if (a.bake.indirectOnly && a.bake.bounces == 0)
    return usageError("--indirect-only and --bounces 0 leave no light; give one of them");
  if (a.bake.targetError > 0.0f && a.samples > a.bake.maxSamples)
    return usageError("--samples " + std::to_string(a.samples) + " is more than --max-samples " +
                      std::to_string(a.bake.maxSamples));
  return checkSky(a);
}

/// More samples of a shadow are not told apart in 8 bits.
constexpr int kMostMaskSamples = 256;

/// Warns where no lamp has a shadow mask. Errors: Input, where more have one than a map has channels.
Expected<void> checkShadowMasks(const BakeArguments& a, Scene& scene) {
  if (!a.shadowMasks) return {};
  const std::vector<std::size_t> marked = lightsWithMask(scene.lights);
  if (marked.empty())
    scene.report.warnings.push_back(
        "--shadow-masks: no lamp is marked; give those that shall have one extras.lumel.light = {\"shadow_mask\": "
        "true}");
  if (marked.size() <= kMostShadowMasks) return {};
  return inputError(a.scene.string() + ": light '" + scene.lights[marked[kMostShadowMasks]].name + "' is number " +
                    std::to_string(kMostShadowMasks + 1) + " of " + std::to_string(marked.size()) +
                    " with a shadow mask; a map holds four, take extras.lumel.light.shadow_mask from the others");
}

void printSettings(const nlohmann::ordered_json& settings) {
  std::string line = "settings";
  for (const auto& [key, value] : settings.items()) {
    if (value.is_null() || value == "auto") continue;
    line += " " + key + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
  }
  std::fprintf(stderr, "%s\n", line.c_str());
}

void printSummary(const fs::path& output, const AtlasResult& atlas, const BakeResult& result,
                  const BakeRecord& record) {
  double texels = 0.0;
  for (const Page& page : atlas.atlas.pages)
    texels += static_cast<double>(page.width) * static_cast<double>(page.height);
  double seconds = 0.0;
  for (const StageTime& stage : record.stages) seconds += stage.seconds;
  const BakeStats& stats = result.stats;
  const double rays = static_cast<double>(stats.rays + stats.shadowRays);
  std::fprintf(stderr, "%s: %zu page%s, %.1f%% covered, %zu chart%s, %llu texels", output.c_str(),
               atlas.atlas.pages.size(), atlas.atlas.pages.size() == 1 ? "" : "s",
               texels > 0 ? 100.0 * static_cast<double>(stats.texels) / texels : 0.0, atlas.atlas.charts.size(),
               atlas.atlas.charts.size() == 1 ? "" : "s", static_cast<unsigned long long>(stats.texels));
  if (atlas.atlas.texelsPerMeter > 0.0f)
    std::fprintf(stderr, " at %.4g per metre", static_cast<double>(atlas.atlas.texelsPerMeter));
  std::fprintf(stderr, "\nmean light %.4g, ", stats.meanFlat);
  if (stats.meanFlat > 0.0 && !stats.errors.empty()) {
    const MapErrorFigure& worst = worstOf(stats.errors);
    std::fprintf(stderr, "standard error %.2g%%, of the worst map (%s) %.2g%%",
                 100.0 * stats.errors.front().mean / stats.meanFlat, worst.map.c_str(),
                 100.0 * worst.mean / stats.meanFlat);
  } else
    std::fputs("standard error not known", stderr);
  std::fprintf(stderr, ", projection residual %.2g%%\n", 100.0 * stats.projectionResidual);
  if (stats.seams.points > 0)
    std::fprintf(stderr, "steps at seams %.2g%% (%.2g%% before), at most %.2g%% (%.2g%%)\n",
                 100.0 * stats.seams.after.rms, 100.0 * stats.seams.before.rms, 100.0 * stats.seams.after.most,
                 100.0 * stats.seams.before.most);
  if (result.audit && result.audit->judged()) {
    const AuditStratum& all = result.audit->all;
    std::fprintf(stderr, "audit: light is %.4g times that of path tracing (95%%: %.4g to %.4g, %zu texels)\n",
                 all.ratio, all.ratio - 1.96 * all.standardError, all.ratio + 1.96 * all.standardError, all.drawn);
  }
  std::fprintf(stderr, "%.1f s, %.1f million rays (%.1f million per second of bake), %.0f MiB at the peak\n", seconds,
               rays / 1e6, stats.seconds > 0 ? rays / 1e6 / stats.seconds : 0.0,
               static_cast<double>(record.peakMemoryBytes) / (1024.0 * 1024.0));
}

int samplesOf(const BakeArguments& a) {
  if (a.samples > 0) return a.samples;
  return a.bake.targetError > 0.0f ? std::min(kLeastSamples, a.bake.maxSamples) : samplesOf(a.quality);
}

bool denoises(const BakeArguments& a) {
  if (a.denoise != Denoise::Auto) return a.denoise == Denoise::On;
  return a.bake.integrator == Integrator::Gather;
}

bool audits(const BakeArguments& a) {
  if (a.auditFailAbove > 0.0f) return true;
  if (a.audit != Audit::Auto) return a.audit == Audit::On;
  return a.bake.integrator == Integrator::Gather && samplesOf(a) >= samplesOf(Quality::Preview);
}

std::vector<std::string> objectNames(const Scene& scene) {
  std::vector<std::string> names;
  for (const Instance& instance : scene.instances) names.push_back(instance.name);
  return names;
}

/// What is wrong for certain, one line each.
std::vector<std::string> auditWarnings(const AuditReport& report) {
  std::vector<std::string> lines;
  const auto add = [&](const AuditStratum& stratum) {
    if (!stratum.wrong) return;
    char text[256];
    std::snprintf(
        text, sizeof text, "audit: %s: light is %.3g times that of path tracing (+- %.2g), most at (%.4g, %.4g, %.4g)",
        stratum.name.c_str(), stratum.ratio, 1.96 * stratum.standardError, static_cast<double>(stratum.position.x),
        static_cast<double>(stratum.position.y), static_cast<double>(stratum.position.z));
    lines.emplace_back(text);
  };
  add(report.all);
  for (const AuditStratum& stratum : report.decades) add(stratum);
  for (const AuditStratum& stratum : report.objects) add(stratum);
  return lines;
}

BakeRecord recordOf(const BakeArguments& a, int dilate, nlohmann::ordered_json settings) {
  settings["dilate"] = dilate;
  // What cannot change the result is kept out of the settings, so that equal bakes have equal settings.
  for (const char* key : {"output", "threads"}) settings.erase(key);
  BakeRecord record;
  record.sceneFile = a.scene;
  record.atlasOptions = a.atlas;
  record.bakeOptions = a.bake;
  record.bakeOptions.samples = samplesOf(a);
  record.dilate = dilate;
  record.half = a.half;
  record.sceneForm = a.flatten ? SceneForm::Flattened : SceneForm::Instances;
  record.threads = availableThreads();
  record.settings = std::move(settings);
  return record;
}

Expected<AtlasResult> makeAtlas(const Scene& scene, const BakeArguments& a, CommandContext& context) {
  AtlasOptions options = a.atlas;
  if (!a.layoutFrom.empty()) {
    auto layout = readEarlierLayout(a.layoutFrom);
    if (!layout) return layout.error();
    options.layout = std::move(*layout);
  }
  auto atlas = buildAtlas(scene, options, context.progress);
  if (!atlas || context.quiet) return atlas;
  printWarnings(atlas->report.warnings);
  if (!atlas->report.sceneUvs.empty()) std::fprintf(stderr, "%s\n", atlas->report.uvChoice.c_str());
  if (options.layout)
    std::fprintf(stderr, "%zu of %zu charts (%.1f%% of their surface) stay where they were\n", atlas->report.keptCharts,
                 atlas->report.generatedCharts + atlas->report.objectsWithOwnUvs, 100.0 * atlas->report.keptShare);
  return atlas;
}

Expected<void> runBake(const BakeArguments& a, CommandContext& context) {
  if (auto checked = check(a, context.options); !checked) return checked;
  for (const fs::path& input : {a.scene, a.sky})
    if (isBakeFile(input.filename().string()))
      if (auto apart = checkNoInput(a.output / input.filename(), std::array{input}); !apart) return apart;
  FileSet::recover(a.output);
  if (auto writable = checkWritable(a.output); !writable) return writable;
  keepLargeArraysApart();
  const ThreadLimit limit(a.threads);
  const int samples = samplesOf(a);
  context.settings["samples"] = samples;
  context.settings["denoise"] = denoises(a) ? "on" : "off";
  context.settings["audit"] = audits(a) ? "on" : "off";
  const int dilate = a.dilate == kDilateByPadding ? (a.atlas.padding + 1) / 2 : a.dilate;
  auto encoding = encodingsOf(a.encodings, a.projection);
  if (!encoding) return encoding.error();
  if (a.bake.seams && !std::ranges::all_of((*encoding)->groups(), [](const MapGroup& g) { return canMend(g.count); }))
    return usageError("--seams on does not know the maps of zh3; leave one of them out");
  BakeRecord record = recordOf(a, dilate, context.settings);
  record.bakeOptions.encoding = std::move(*encoding);

  StageClock clock(context.quiet);
  Progress& progress = context.progress;
  clock.start("load");
  auto scene = loadLitScene(a, context.progress);
  if (!scene) return scene.error();
  if (auto kept = keepObjects(a.objects, *scene); !kept) return kept.error();
  if (a.half) warnOfHalf(*scene);
  if (auto checked = checkShadowMasks(a, *scene); !checked) return checked;
  auto volumes = volumesOf(a.volumes, *scene);
  if (!volumes) return volumes.error();
  if (!volumes->empty() && a.bake.integrator != Integrator::Gather)
    return usageError("--volume: light volumes are gathered from the surfaces of a gather; take --integrator gather");
  if (!context.quiet) printSettings(record.settings);
  if (!context.quiet) printNotes(scene->report.notes);
  if (!context.quiet) printWarnings(scene->report.warnings);
  if (progress.cancelled()) return interrupted();

  clock.start("atlas");
  const SplitReport split = splitLongTriangles(*scene, a.atlas);
  if (split.triangles > 0 && !context.quiet)
    std::fprintf(stderr, "%zu triangles are too long for a page at this density: they are split into %zu\n",
                 split.triangles, split.pieces);
  const auto atlas = makeAtlas(*scene, a, context);
  if (!atlas) return atlas.error();
  if (atlas->atlas.charts.empty()) {
    scene->report.warnings.push_back("no triangle of the scene gets a lightmap (" +
                                     std::to_string(scene->report.degenerateTriangles) + " without area, " +
                                     std::to_string(scene->report.skippedPrimitives) +
                                     " primitives of points or lines are left out)");
    if (!context.quiet) printWarnings({scene->report.warnings.back()});
  }
  returnFreeMemory();
  clock.start("texels");
  const auto texels = findTexels(atlas->atlas);
  returnFreeMemory();
  clock.start("bake");
  auto lit = LitScene::build(*scene, record.bakeOptions.bounces != 0);
  if (!lit) return lit.error();
  GatherSession session;
  session.keepsSurfaces = !volumes->empty();
  auto baked = bake(**lit, atlas->atlas, texels, record.bakeOptions, progress, &session);
  if (!baked) return baked.error();
  if (session.surfaces) {
    clock.start("volumes");
    const VolumeOptions options{.samples = a.volumes.samples, .indirectOnly = a.bake.indirectOnly, .seed = a.bake.seed};
    if (auto done = bakeVolumes((*lit)->transport(), *session.surfaces, *volumes, options, progress); !done)
      return done;
    baked->volumes = *std::move(volumes);
    session.surfaces.reset();
  }
  clock.start("finish");
  baked->stats.seams = finishPages(baked->pages, atlas->atlas, texels,
                                   {.denoise = denoises(a),
                                    .rings = dilate,
                                    .seams = &baked->seams,
                                    .groups = record.bakeOptions.encoding->groups()});
  baked->stats.errors = statedErrors(baked->pages, *record.bakeOptions.encoding);
  encodePages(baked->pages, *record.bakeOptions.encoding);
  if (a.half) cutToHalf(*baked);
  if (a.shadowMasks) {
    clock.start("shadow masks");
    auto masks = bakeShadowMasks(
        **lit, scene->lights, atlas->atlas, texels, baked->pages,
        {.samples = std::min(record.bakeOptions.samples, kMostMaskSamples), .rings = dilate, .seed = a.bake.seed},
        progress);
    if (!masks) return masks.error();
    baked->shadowMasks = *std::move(masks);
  }
  if (audits(a)) {
    clock.start("audit");
    auditBake(**lit, atlas->atlas, texels, record.bakeOptions, objectNames(*scene), *baked);
    const std::vector<std::string> found = auditWarnings(*baked->audit);
    baked->stats.notes.insert(baked->stats.notes.end(), found.begin(), found.end());
  }
  lit->reset();
  clock.stop();
  if (progress.cancelled()) return interrupted();

  record.stages = clock.stages();
  record.peakMemoryBytes = peakMemoryBytes();
  clock.start("write");
  if (auto written = writeBake(a.output, *scene, *atlas, *baked, record); !written) return written;
  clock.stop();
  record.stages = clock.stages();
  record.peakMemoryBytes = peakMemoryBytes();
  if (!context.quiet) {
    printSummary(a.output, *atlas, *baked, record);
    printWarnings(baked->stats.notes);
  }
  const std::size_t warnings =
      scene->report.warnings.size() + atlas->report.warnings.size() + baked->stats.notes.size();
  if (a.strict && warnings > 0)
    return Error{ErrorKind::Threshold, "--strict: " + std::to_string(warnings) + " warning" +
                                           (warnings == 1 ? "" : "s") + "; they are in " +
                                           (a.output / "bake.json").string()};
  if (a.auditFailAbove > 0.0f && baked->audit->worst() > static_cast<double>(a.auditFailAbove))
    return Error{ErrorKind::Threshold, a.output.string() + ": the audit found light that is wrong by more than " +
                                           "--audit-fail-above; the result is written, bake.json says where"};
  return {};
}

}  // namespace

Command bakeCommand() {
  Command command;
  const auto arguments = std::make_shared<BakeArguments>();
  command.name = "bake";
  command.summary = "Bake a scene into lightmaps: three RNM maps and a flat one per atlas page";
  command.takesConfig = true;
  command.examples = describeEncodingChoices() +
                     "Examples:\n"
                     "  lumel bake level.gltf -o out/level\n"
                     "      lights and emissive surfaces of the file, one page of 1024 x 1024\n"
                     "  lumel bake level.glb -o out/level --sky noon.hdr --sky-rotation 90 --texels-per-meter 16\n"
                     "      light from a sky image, as many pages as 16 texels per metre need\n"
                     "  lumel bake level.obj -o out/level --sky-color 0.4 0.6 1 --samples 64 --bounces 2\n"
                     "      a quick preview under an even blue sky\n"
                     "  lumel bake --config level.toml\n"
                     "      everything from a file: scene = \"level.gltf\", output = \"out/level\", samples = 1024";
  declareOptions(command.options, *arguments);
  command.run = [arguments](CommandContext& context) { return runBake(*arguments, context); };
  return command;
}

}  // namespace lumel
