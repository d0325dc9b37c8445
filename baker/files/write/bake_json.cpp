#include "baker/files/write/bake_json.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "baker/bake/shadow_masks.h"
#include "baker/files/names/bake_format.h"
#include "baker/files/names/conventions.h"
#include "baker/files/names/file_names.h"
#include "baker/files/names/version.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }

Json describePage(std::size_t index, const BakedPage& page, const std::vector<StoredEncoding>& encodings,
                  std::size_t charts) {
  std::size_t covered = 0;
  std::size_t invalid = 0;
  double area = 0.0;
  Vec3d sum(0.0);
  std::size_t counted = 0;
  for (int y = 0; y < page.aux.height; ++y)
    for (int x = 0; x < page.aux.width; ++x) {
      const float* aux = page.aux.at(x, y);
      if (!(aux[0] > 0.0f)) continue;
      ++covered;
      area += static_cast<double>(aux[0]);
      if (aux[1] < 0.5f) {
        ++invalid;
        continue;
      }
      sum += Vec3d(page.flat.rgb(x, y));
      ++counted;
    }
  const double texels = static_cast<double>(page.aux.width) * static_cast<double>(page.aux.height);
  const Vec3d mean = counted > 0 ? sum / static_cast<double>(counted) : sum;
  Json files = Json::object();
  for (const auto& [encoding, first] : encodings)
    for (const std::string& name : encoding->mapNames())
      if (encoding->name() != kFlatMap) files[encoding->name()].push_back(pageFileName(index, name));
  files["flat"] = pageFileName(index, kFlatMap);
  files["aux"] = pageFileName(index, "aux");
  return {{"page", index},
          {"width", page.aux.width},
          {"height", page.aux.height},
          {"charts", charts},
          {"coveredTexels", covered},
          {"coverage", texels > 0 ? static_cast<double>(covered) / texels : 0.0},
          {"coveredArea", texels > 0 ? area / texels : 0.0},
          {"invalidTexels", invalid},
          {"meanFlat", {mean.x, mean.y, mean.z}},
          {"files", std::move(files)}};
}

Json describePages(const Atlas& atlas, const BakeResult& result, const std::vector<StoredEncoding>& encodings) {
  std::vector<std::size_t> charts(result.pages.size(), 0);
  for (const Chart& chart : atlas.charts)
    if (const auto page = static_cast<std::size_t>(atlas.surfaces[static_cast<std::size_t>(chart.surface)].page);
        page < charts.size())
      ++charts[page];
  Json pages = Json::array();
  for (std::size_t i = 0; i < result.pages.size(); ++i)
    pages.push_back(describePage(i, result.pages[i], encodings, charts[i]));
  return pages;
}

std::string hexOf(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

Json describeCharts(const Atlas& atlas) {
  std::vector<std::size_t> triangles(atlas.charts.size(), 0);
  for (const Surface& surface : atlas.surfaces)
    for (std::uint32_t chart : surface.charts) ++triangles[chart];
  Json rows = Json::array();
  for (std::size_t i = 0; i < atlas.charts.size(); ++i) {
    const Chart& chart = atlas.charts[i];
    const Surface& surface = atlas.surfaces[static_cast<std::size_t>(chart.surface)];
    rows.push_back({surface.page, surface.instance, surface.primitive, chart.texelsPerMeter, triangles[i],
                    chart.key != 0 ? Json(hexOf(chart.key)) : Json(nullptr), chart.quarterTurns, chart.x, chart.y});
  }
  return {{"columns", chartColumns()}, {"rows", std::move(rows)}};
}

/// Where the lightmap of each object lies: what the nodes of scene.glb say. An object with charts of ours on several
/// pages has no page here: "charts" tells them.
Json describeObjects(const Scene& scene, const Atlas& atlas) {
  Json rows = Json::array();
  for (std::size_t first = 0, last; first < atlas.surfaces.size(); first = last) {
    const int instance = atlas.surfaces[first].instance;
    LightmapPlace place{atlas.surfaces[first].page};
    for (last = first; last < atlas.surfaces.size() && atlas.surfaces[last].instance == instance; ++last)
      if (atlas.surfaces[last].page != place.page) place.page = -1;
    const auto index = static_cast<std::size_t>(instance);
    if (index < atlas.places.size() && atlas.places[index].page >= 0) place = atlas.places[index];
    rows.push_back({instance,
                    scene.instances[index].name,
                    place.page >= 0 ? Json(place.page) : Json(nullptr),
                    {place.scale.x, place.scale.y},
                    {place.offset.x, place.offset.y}});
  }
  return {{"columns", {"instance", "name", "page", "scale", "offset"}}, {"rows", std::move(rows)}};
}

/// What a later bake needs to keep charts where they are (with the list of charts). Null without generated charts.
Json describeLayout(const Atlas& atlas, const AtlasOptions& options) {
  if (!(atlas.chartDensity > 0)) return nullptr;
  return {{"chartDensity", atlas.chartDensity}, {"scale", atlas.chartScale},  {"firstPage", atlas.sceneUvPages},
          {"pageSize", options.pageSize},       {"padding", options.padding}, {"blockAlign", options.blockAlign},
          {"maxStretch", options.maxStretch}};
}

Json describeSceneUvs(const AtlasReport& report) {
  Json rows = Json::array();
  for (const UvReport& uv : report.sceneUvs)
    rows.push_back({{"mesh", uv.mesh},
                    {"instances", uv.instances},
                    {"present", uv.present},
                    {"valid", uv.valid},
                    {"outOfRangeVertices", uv.outOfRangeVertices},
                    {"zeroAreaTriangles", uv.zeroAreaTriangles},
                    {"overlapTexels", uv.overlapTexels},
                    {"coveredTexels", uv.coveredTexels},
                    {"frameCrossingTexels", uv.frameCrossingTexels}});
  return rows;
}

Json describeSky(const Environment& sky) {
  if (sky.isBlack()) return nullptr;
  Json json = {{"strength", sky.strength}};
  if (sky.image.empty()) {
    json["color"] = toJson(sky.color);
  } else {
    json["file"] = "sky.exr";
    json["rotationDegrees"] = sky.rotationDegrees;
  }
  return json;
}

/// The lamps, as scene.glb has them, for readers that light with them.
Json describeLights(const Scene& scene) {
  Json rows = Json::array();
  for (const Light& light : scene.lights)
    rows.push_back({{"name", light.name}, {"type", nameOf(light.type)}, {"mode", nameOf(light.mode)}});
  return rows;
}

/// Which lamp each channel of the shadow masks is of; null without these.
Json describeShadowMasks(const Scene& scene, const BakeResult& result) {
  if (result.shadowMasks.empty()) return nullptr;
  constexpr const char* kChannels[] = {"R", "G", "B", "A"};
  Json rows = Json::array();
  for (const std::size_t light : lightsWithMask(scene.lights))
    rows.push_back({{"channel", kChannels[rows.size()]}, {"light", light}, {"name", scene.lights[light].name}});
  Json files = Json::array();
  for (std::size_t page = 0; page < result.shadowMasks.size(); ++page) files.push_back(pageFileName(page, "masks"));
  return {{"lamps", std::move(rows)}, {"files", std::move(files)}};
}

/// The descriptions of the light volumes, by their files.
Json describeVolumes(const BakeResult& result) {
  Json files = Json::array();
  for (std::size_t volume = 0; volume < result.volumes.size(); ++volume) files.push_back(volumeFileName(volume));
  return files;
}

/// All encodings of the bake, each with the conventions that are its own; "encoding" and "conventions" say the same of
/// the first alone.
Json describeEncodings(const std::vector<StoredEncoding>& encodings) {
  Json rows = Json::array();
  for (const StoredEncoding& stored : encodings) {
    rows.push_back(describeEncoding(*stored.encoding));
    rows.back()["conventions"] = stored.encoding->conventions();
  }
  return rows;
}

Json describeScene(const Scene& scene, const BakeRecord& record) {
  return {{"file", record.sceneFile.string()},
          {"instances", scene.instances.size()},
          {"materials", scene.materials.size()},
          {"lights", scene.lights.size()},
          {"notes", scene.report.notes},
          {"degenerateTriangles", scene.report.degenerateTriangles},
          {"skippedPrimitives", scene.report.skippedPrimitives}};
}

Json describeSeams(const SeamFigures& seams) {
  if (seams.points == 0) return nullptr;
  const auto steps = [](const SeamSteps& s) { return Json{{"rms", s.rms}, {"max", s.most}}; };
  return {{"texels", seams.texels}, {"stepsBefore", steps(seams.before)}, {"steps", steps(seams.after)}};
}

Json describeError(const BakeStats& stats) {
  Json flat = nullptr, all = nullptr, worst = nullptr;
  if (!stats.errors.empty()) {
    flat = stats.errors.front().mean;
    all = Json::object();
    for (const MapErrorFigure& figure : stats.errors) all[figure.map] = figure.mean;
    worst = worstOf(stats.errors).map;
  }
  return {{"meanFlat", stats.meanFlat},
          {"meanStandardError", flat},
          {"standardErrors", all},
          {"worstMap", worst},
          {"projectionResidual", stats.projectionResidual},
          {"seams", describeSeams(stats.seams)},
          {"nonFiniteSamples", stats.nonFiniteSamples}};
}

Json describeStratum(const AuditStratum& stratum, const Atlas& atlas) {
  const auto finite = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
  Json json = {
      {"name", stratum.name},
      {"texels", stratum.texels},
      {"drawn", stratum.drawn},
      {"ratio", finite(stratum.ratio)},
      {"interval95",
       {finite(stratum.ratio - 1.96 * stratum.standardError), finite(stratum.ratio + 1.96 * stratum.standardError)}},
      {"detectable", stratum.detectable()},
      {"wrong", stratum.wrong}};
  if (stratum.wrong && stratum.page < atlas.pages.size()) {
    json["page"] = stratum.page;
    json["texel"] = {stratum.texel.x, stratum.texel.y};
    json["position"] = toJson(stratum.position);
  }
  return json;
}

/// What path tracing of texels drawn at random says of the maps; null where nothing was audited.
Json describeAudit(const BakeResult& result, const Atlas& atlas) {
  if (!result.audit || !result.audit->judged()) return nullptr;
  const AuditReport& audit = *result.audit;
  const auto describe = [&](const std::vector<AuditStratum>& strata) {
    constexpr std::size_t kMostListed = 50;
    Json rows = Json::array();
    for (std::size_t i = 0; i < std::min(strata.size(), kMostListed); ++i)
      rows.push_back(describeStratum(strata[i], atlas));
    return rows;
  };
  return {{"all", describeStratum(audit.all, atlas)},
          {"decades", describe(audit.decades)},
          {"objects", describe(audit.objects)},
          {"objectsNotJudged", audit.objectsNotJudged},
          {"rays", audit.rays}};
}

Json describeRun(const BakeStats& stats, const BakeRecord& record) {
  Json stages = Json::object();
  double seconds = 0.0;
  for (const StageTime& stage : record.stages) {
    stages[stage.stage] = stage.seconds;
    seconds += stage.seconds;
  }
  return {
      {"threads", record.threads},
      {"seconds", seconds},
      {"stageSeconds", std::move(stages)},
      {"raysPerSecond", stats.seconds > 0 ? static_cast<double>(stats.rays + stats.shadowRays) / stats.seconds : 0.0},
      {"peakMemoryBytes", record.peakMemoryBytes}};
}

}  // namespace

std::string describeBake(const Scene& scene, const AtlasResult& atlas, const BakeResult& result,
                         const BakeRecord& record) {
  std::vector<std::string> warnings = scene.report.warnings;
  warnings.insert(warnings.end(), atlas.report.warnings.begin(), atlas.report.warnings.end());
  const std::vector<StoredEncoding> encodings = record.bakeOptions.encoding->stored();
  const Encoding& encoding = *encodings.front().encoding;
  Json json;
  json["format"] = kBakeFormat;
  json["lumel"] = kVersion;
  json["scene"] = describeScene(scene, record);
  json["settings"] = record.settings;
  json["encoding"] = describeEncoding(encoding);
  json["encodings"] = describeEncodings(encodings);
  json["conventions"] = describeConventions(encoding);
  json["conventions"]["aux"] = describeAuxChannels(encoding);
  json["sky"] = describeSky(scene.environment);
  json["lights"] = describeLights(scene);
  json["shadowMasks"] = describeShadowMasks(scene, result);
  json["volumes"] = describeVolumes(result);
  json["atlas"] = {{"texelsPerMeter", atlas.atlas.texelsPerMeter},
                   {"charts", atlas.atlas.charts.size()},
                   {"generatedCharts", atlas.report.generatedCharts},
                   {"nonManifoldEdges", atlas.report.nonManifoldEdges},
                   {"degenerateTriangles", atlas.report.degenerateTriangles},
                   {"objectsWithOwnUvs", atlas.report.objectsWithOwnUvs},
                   {"sceneUvs", describeSceneUvs(atlas.report)},
                   {"layout", describeLayout(atlas.atlas, record.atlasOptions)}};
  json["pages"] = describePages(atlas.atlas, result, encodings);
  json["cost"] = {
      {"texels", result.stats.texels}, {"rays", result.stats.rays}, {"shadowRays", result.stats.shadowRays}};
  json["error"] = describeError(result.stats);
  json["audit"] = describeAudit(result, atlas.atlas);
  json["warnings"] = warnings;
  json["notes"] = result.stats.notes;
  json["objects"] = describeObjects(scene, atlas.atlas);
  json["charts"] = describeCharts(atlas.atlas);
  json["run"] = describeRun(result.stats, record);
  return bakeJsonText(json);
}

}  // namespace lumel
