// lumel study: what error a bake of a scene has, and what less of it costs.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <ostream>

#include "baker/bake/quality.h"
#include "baker/commands/command.h"
#include "baker/commands/scene_arguments.h"
#include "baker/study/study_encodings.h"
#include "baker/study/study_files.h"
#include "lightmap/atlas/split_triangles.h"
#include "scene/base/parallel.h"
#include "scene/files/file_set.h"

namespace lumel {
namespace {

struct StudyArguments : SceneArguments {
  std::filesystem::path output;
  StudyOptions study;
  float timeBudget = 180.0f;
  bool encodings = false;
  int threads = 0;
};

void declareOptions(OptionTable& options, StudyArguments& a) {
  declareScene(options, a);
  options.group("Files");
  Option& output = options.path("output", a.output, "Folder for tables (CSV, JSON, Markdown) and plots (SVG)");
  output.shortName = "o";
  output.placeholder = "DIR";
  output.required = true;
  declareOutsidePaths(options, a);
  declareSsbump(options, a);
  options.group("Study");
  options.flag("encodings", a.encodings,
               "Compare the encodings of lumel bake --encoding instead: size, error on normals that lean, negative "
               "light and time, into encodings.md and encodings.json");
  options.number("time-budget", a.timeBudget, {0.0f},
                 "Seconds for the whole: half go to the reference; bakes that would end later are left out and named. "
                 "0: no limit");
  options.integer("reference-samples", a.study.referenceSamples, {0, 1 << 20},
                  "Samples of each of the reference's two halves; 0: as many as the time allows");
  options.integer("max-samples", a.study.mostSamples, {kStudyLeastSamples, 1 << 20},
                  "The gather is measured at 4, 8, 16, ... samples up to this many");
  options.group("Light");
  options.integerOrWord("bounces", a.study.bounces, {0, 1024}, "all", kAllBounces,
                        "Indirect bounces; 0: direct light only, all: as many as matter");
  declareSkyAndSides(options, a);
  options.choice("projection", a.study.projection, {"raw", "flat", "fit", "signed"},
                 "Of the maps that are compared; the residual is measured for all three");
  options.integer("seed", a.study.seed, "Seed of the candidates; the reference has seeds of its own");
  // A study needs tens of bakes: a small page says the same about error per texel.
  a.study.atlas.pageSize = 128;
  declareAtlasOptions(options, a.study.atlas);
  options.group("General");
  options.integer("threads", a.threads, {0, 1024}, "Threads to use, without influence on errors; 0: one per core");
}

Expected<void> runEncodingStudy(const StudyArguments& a, const Scene& scene, CommandContext& context) {
  const EncodingStudyOptions options{.atlas = a.study.atlas,
                                     .bounces = a.study.bounces,
                                     .projection = a.study.projection,
                                     .seed = a.study.seed,
                                     .samples = std::min(a.study.mostSamples, samplesOf(Quality::Production))};
  const auto result = studyEncodings(scene, options, context.progress);
  if (!result) return result.error();
  const std::string name = a.scene.filename().string();
  if (auto written = writeEncodingStudy(a.output, *result, name, options.samples, context.settings); !written)
    return written;
  if (!context.quiet) context.out << encodingStudyMarkdown(*result, name, options.samples);
  return {};
}

Expected<void> runStudy(const StudyArguments& a, CommandContext& context) {
  if (auto checked = checkAtlas(a.study.atlas); !checked) return checked;
  if (auto checked = checkSky(a); !checked) return checked;
  if (auto writable = checkWritable(a.output); !writable) return writable;
  const ThreadLimit limit(a.threads);
  auto scene = loadLitScene(a, context.progress);
  if (!scene) return scene.error();
  splitLongTriangles(*scene, a.study.atlas);
  if (!hasLight(*scene)) return inputError(a.scene.string() + ": nothing in it shines; give --sky-color or --sky");
  if (!context.quiet) printNotes(scene->report.notes);
  if (!context.quiet) printWarnings(scene->report.warnings);
  if (a.encodings) return runEncodingStudy(a, *scene, context);
  if (!context.quiet) std::fprintf(stderr, "study of %s: a reference, then the candidates\n", a.scene.c_str());
  StudyOptions options = a.study;
  options.timeBudgetSeconds = static_cast<double>(a.timeBudget);
  const auto result = study(*scene, options, context.progress);
  if (!result) return result.error();
  const std::string name = a.scene.filename().string();
  if (auto written = writeStudy(a.output, *result, name, context.settings); !written) return written;
  if (!context.quiet) context.out << studyMarkdown(*result, name);
  return {};
}

}  // namespace

Command studyCommand() {
  Command command;
  const auto arguments = std::make_shared<StudyArguments>();
  command.name = "study";
  command.summary = "Measure what a bake of a scene costs and how wrong it is";
  command.takesConfig = true;
  command.examples =
      "Measures error against time and rays by samples, integrators, projections and texel densities, held against a\n"
      "long path-traced bake.\n"
      "\n"
      "How to read it: pick the error that you can live with in study.md, and bake with the samples of that row, or "
      "let\n"
      "lumel bake --target-error find them. The reference is two independent halves; how they differ tells its own\n"
      "error, which is stated, drawn as a dashed line and taken off. Times are those of this machine: keep it idle.\n"
      "\n"
      "Examples:\n"
      "  lumel study level.gltf -o out/study\n"
      "      three minutes on one page of 128 x 128\n"
      "  lumel study level.glb -o out/study --sky noon.hdr --page-size 512 --time-budget 1800\n"
      "      half an hour on more texels\n"
      "  lumel study level.gltf -o out/encodings --encodings\n"
      "      what each encoding costs and loses on this level\n"
      "  lumel study level.glb -o out/study --reference-samples 4096 --time-budget 0\n"
      "      whatever it takes; errors are the same on every machine";
  declareOptions(command.options, *arguments);
  command.run = [arguments](CommandContext& context) { return runStudy(*arguments, context); };
  return command;
}

}  // namespace lumel
