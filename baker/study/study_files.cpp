#include "baker/study/study_files.h"

#include <cmath>
#include <cstdio>

#include "baker/files/names/version.h"
#include "baker/study/plot.h"
#include "scene/files/file_set.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string format(const char* how, double v) {
  char text[48];
  std::snprintf(text, sizeof text, how, v);
  return text;
}

/// Per cent with as many digits as mean something.
std::string percent(double share) {
  const double p = 100.0 * share;
  return format(std::abs(p) >= 9.95 ? "%.1f%%" : "%.2f%%", p);
}

double raysPerTexel(const StudyPoint& p) {
  return p.texels > 0 ? static_cast<double>(p.rays) / static_cast<double>(p.texels) : 0.0;
}

std::string tableOfSamples(const Study& study) {
  std::string md =
      "| series | samples | rays / texel | CPU s | wall s | flat RMSE | flat bias | RNM RMSE | RNM bias | within "
      "interval: flat | RNM |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const StudyPoint& p : study.points) {
    if (!p.hasMaps) continue;
    md += "| " + p.series + " | " + std::to_string(p.samples) + (p.quality.empty() ? "" : " (" + p.quality + ")") +
          " | " + format("%.0f", raysPerTexel(p)) + " | " + format("%.2f", p.cpuSeconds) + " | " +
          format("%.2f", p.seconds) + " | " + percent(p.flat.rmse) + " | " + format("%+.2f%%", 100.0 * p.flat.bias) +
          " | " + percent(p.rnm.rmse) + " | " + format("%+.2f%%", 100.0 * p.rnm.bias) + " | " +
          (p.withinInterval >= 0.0 ? format("%.1f%%", 100.0 * p.withinInterval) : "-") + " | " +
          (p.withinRnm >= 0.0 ? format("%.1f%%", 100.0 * p.withinRnm) : "-") + " |\n";
  }
  return md;
}

std::string tableOfProjections(const Study& study) {
  std::string md;
  for (const StudyPoint& p : study.points)
    if (p.residual >= 0.0) md += std::string("| ") + nameOf(p.projection) + " | " + percent(p.residual) + " |\n";
  return md.empty() ? md : "\n| projection | error of decoded light, normals within 30 degrees |\n|---|---|\n" + md;
}

std::string tableOfDensities(const Study& study) {
  std::string md;
  for (const StudyPoint& p : study.points)
    if (p.seen >= 0.0)
      md += "| " + (p.texelsPerMeter > 0.0f ? format("%.4g", static_cast<double>(p.texelsPerMeter)) : "scene UVs") +
            " | " + std::to_string(p.texels) + " | " + format("%.2f", p.cpuSeconds) + " | " + percent(p.seen) + " |\n";
  return md.empty() ? md
                    : "\n| texels per metre | texels | CPU s | error of bilinear lookups at the reference's texels |\n"
                      "|---|---|---|---|\n" +
                          md;
}

/// Error against `cost`, a figure of a point, for the series over samples.
template <class Cost>
Plot errorPlot(const Study& study, const std::string& title, const std::string& xLabel, Cost cost) {
  Plot plot{title, xLabel, "relative RMSE, %", {}, {}};
  for (const char* name : {"gather", "denoised", "path"})
    for (const bool rnm : {false, true}) {
      PlotSeries series{std::string(name) + (rnm ? ", RNM maps" : ", flat map"), {}};
      for (const StudyPoint& p : study.points)
        if (p.hasMaps && p.series == name)
          series.points.push_back(
              {cost(p), 100.0 * (rnm ? p.rnm.rmse : p.flat.rmse), rnm || p.series != "gather" ? "" : p.quality});
      if (!series.points.empty()) plot.series.push_back(std::move(series));
    }
  plot.levels.push_back({"noise of the reference", 100.0 * study.reference.flatError});
  return plot;
}

Plot densityPlot(const Study& study) {
  PlotSeries series{"gather, flat map", {}};
  for (const StudyPoint& p : study.points)
    if (p.seen >= 0.0) series.points.push_back({static_cast<double>(p.texels), 100.0 * p.seen, {}});
  return {"Error of the light as seen, by texel density", "texels", "relative RMSE, %", {std::move(series)}, {}};
}

Json toJson(const StudyPoint& p) {
  Json json = {{"series", p.series},
               {"quality", p.quality},
               {"integrator", nameOf(p.integrator)},
               {"projection", nameOf(p.projection)},
               {"samples", p.samples},
               {"texelsPerMeter", p.texelsPerMeter},
               {"texels", p.texels},
               {"rays", p.rays},
               {"seconds", p.seconds},
               {"cpuSeconds", p.cpuSeconds}};
  if (p.hasMaps) {
    json["flat"] = {{"rmse", p.flat.rmse}, {"bias", p.flat.bias}};
    json["rnm"] = {{"rmse", p.rnm.rmse}, {"bias", p.rnm.bias}};
    json["claimed"] = p.claimed;
    if (p.withinInterval >= 0.0) json["withinInterval"] = p.withinInterval;
    if (p.withinRnm >= 0.0) json["withinIntervalRnm"] = p.withinRnm;
  }
  if (p.residual >= 0.0) json["residual"] = p.residual;
  if (p.seen >= 0.0) json["seen"] = p.seen;
  return json;
}

}  // namespace

std::string studyCsv(const Study& study) {
  std::string csv =
      "series,quality,integrator,projection,samples,texels_per_meter,texels,rays,seconds,cpu_seconds,flat_rmse,"
      "flat_bias,rnm_rmse,rnm_bias,claimed,within_interval,within_interval_rnm,residual,seen\n";
  for (const StudyPoint& p : study.points) {
    csv += p.series + "," + p.quality + "," + nameOf(p.integrator) + "," + nameOf(p.projection) + "," +
           std::to_string(p.samples) + "," + format("%.6g", static_cast<double>(p.texelsPerMeter)) + "," +
           std::to_string(p.texels) + "," + std::to_string(p.rays) + "," + format("%.4f", p.seconds) + "," +
           format("%.4f", p.cpuSeconds);
    for (const double v : {p.flat.rmse, p.flat.bias, p.rnm.rmse, p.rnm.bias, p.claimed})
      csv += "," + (p.hasMaps ? format("%.6g", v) : std::string());
    for (const double v : {p.withinInterval, p.withinRnm, p.residual, p.seen})
      csv += "," + (v >= 0.0 ? format("%.6g", v) : std::string());
    csv += "\n";
  }
  return csv;
}

std::string studyJson(const Study& study, const Json& settings) {
  Json points = Json::array();
  for (const StudyPoint& p : study.points) points.push_back(toJson(p));
  const StudyReference& r = study.reference;
  const Json json = {{"lumel", kVersion},
                     {"settings", settings},
                     {"texels", study.texels},
                     {"texelsPerMeter", study.texelsPerMeter},
                     {"reference",
                      {{"integrator", "path"},
                       {"halves", 2},
                       {"samplesOfAHalf", r.samples},
                       {"seconds", r.seconds},
                       {"cpuSeconds", r.cpuSeconds},
                       {"rays", r.rays},
                       {"meanFlat", r.meanFlat},
                       {"flatError", r.flatError},
                       {"rnmError", r.rnmError}}},
                     {"points", std::move(points)},
                     {"notes", study.notes}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string studyMarkdown(const Study& study, const std::string& scene) {
  const StudyReference& r = study.reference;
  std::string md = "# Study of " + scene + "\n\n" + std::to_string(study.texels) + " texels";
  if (study.texelsPerMeter > 0.0f)
    md += ", " + format("%.4g", static_cast<double>(study.texelsPerMeter)) + " per metre";
  md += ". Reference: path tracing, 2 x " + std::to_string(r.samples) +
        " samples with seeds of their own. By the difference of its halves its own error is " + percent(r.flatError) +
        " (flat) and " + percent(r.rnmError) +
        " (RNM); this is taken off in quadrature below. RMSE and bias are relative to the mean over covered, valid "
        "texels. \"Within interval\" is the share of lit texels that differ from the reference by at most 1.96 of the "
        "standard errors that both state of their maps.\n\n" +
        tableOfSamples(study) + tableOfProjections(study) + tableOfDensities(study);
  if (!study.notes.empty()) md += "\n";
  for (const std::string& note : study.notes) md += "- " + note + "\n";
  return md;
}

Expected<void> writeStudy(const fs::path& dir, const Study& study, const std::string& scene, const Json& settings) {
  auto files = FileSet::forFolder(dir);
  if (!files) return files.error();
  const auto write = [&](const std::string& name, const std::string& text) -> Expected<void> {
    const auto file = files->add(dir / name);
    if (!file) return file.error();
    return writeBytes(*file, text);
  };
  const Plot rays = errorPlot(study, "Error against rays: " + scene, "rays per texel, all kinds", raysPerTexel);
  const Plot time =
      errorPlot(study, "Error against time: " + scene, "CPU seconds", [](const StudyPoint& p) { return p.cpuSeconds; });
  if (auto done = write("study.csv", studyCsv(study)); !done) return done;
  if (auto done = write("study.md", studyMarkdown(study, scene)); !done) return done;
  if (auto done = write("error-rays.svg", plotSvg(rays)); !done) return done;
  if (auto done = write("error-time.svg", plotSvg(time)); !done) return done;
  if (auto done = write("density.svg", plotSvg(densityPlot(study))); !done) return done;
  if (auto done = write("study.json", studyJson(study, settings)); !done) return done;
  return files->commitFolder({});
}

}  // namespace lumel
