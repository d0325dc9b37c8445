#include "baker/commands/scene_lint.h"

#include <cmath>
#include <cstdio>

#include "baker/bake/memory_estimate.h"
#include "lightmap/atlas/lint.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

Json findingJson(const LintFinding& f) {
  return {{"id", f.id},
          {"level", nameOf(f.level)},
          {"count", f.count},
          {"total", f.total},
          {"unit", f.unit},
          {"meaning", f.meaning},
          {"worst", {{"name", f.worst}, {"page", f.page}, {"x", f.x}, {"y", f.y}, {"value", f.worstValue}}}};
}

Json sceneUvJson(const UvReport& r) {
  return {{"name", r.mesh},
          {"present", r.present},
          {"valid", r.valid},
          {"verticesOutOfRange", r.outOfRangeVertices},
          {"trianglesWithoutArea", r.zeroAreaTriangles},
          {"overlapTexels", r.overlapTexels},
          {"coveredTexels", r.coveredTexels},
          {"frameCrossingTexels", r.frameCrossingTexels}};
}

Expected<void> writePictures(const Atlas& atlas, const std::filesystem::path& folder) {
  auto files = FileSet::forFolder(folder);
  if (!files) return files.error();
  WriteImageOptions options;
  options.format = PixelFormat::U8;
  for (int page = 0; page < static_cast<int>(atlas.pages.size()); ++page) {
    const auto file = files->add(folder / ("charts-" + std::to_string(page) + ".png"));
    if (!file) return file.error();
    if (auto written = writeImage(*file, chartPicture(atlas, page), options); !written) return written;
  }
  return files->commit();
}

}  // namespace

Expected<Json> lintScene(const Scene& scene, const SceneLintOptions& options) {
  Progress silent;
  AtlasOptions atlas = options.atlas;
  if (atlas.uvSource == UvSource::Scene) atlas.uvSource = UvSource::AsGiven;
  const Expected<AtlasResult> built = buildAtlas(scene, atlas, silent);
  if (!built) return built.error();
  const LintReport report = lintAtlas(scene, built->atlas, options.atlas.padding);
  if (!options.pictures.empty())
    if (Expected<void> written = writePictures(built->atlas, options.pictures); !written) return written.error();

  Json uvs = Json::array();
  for (const UvReport& uv : built->report.sceneUvs) uvs.push_back(sceneUvJson(uv));
  Json findings = Json::array();
  for (const LintFinding& finding : report.findings)
    if (finding.count > 0) findings.push_back(findingJson(finding));
  Json lines = Json::array();
  for (const std::string& line : lintText(report)) lines.push_back(line);
  BakeSize size = sceneSize(scene);
  size.coveredTexels = report.coveredTexels;
  size.pageTexels = report.pageTexels;
  const double memory = bakeMemory(size);
  char text[80];
  std::snprintf(text, sizeof text, "about %.0f MB while baking", memory / 1e6);
  lines.push_back(text);
  for (const std::string& warning : built->report.warnings) lines.push_back("warning: " + warning);
  return Json{{"atlas",
               {{"texelsPerMeter", built->atlas.texelsPerMeter},
                {"pages", report.pages},
                {"charts", report.charts},
                {"pageTexels", report.pageTexels},
                {"coveredTexels", report.coveredTexels},
                {"mapBytes", report.mapBytes},
                {"bakeMemoryBytes", std::llround(memory)},
                {"nonManifoldEdges", built->report.nonManifoldEdges},
                {"degenerateTriangles", built->report.degenerateTriangles}}},
              {"sceneUvs", std::move(uvs)},
              {"findings", std::move(findings)},
              {"lines", std::move(lines)}};
}

}  // namespace lumel
