#include "lightmap/atlas/atlas.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "lightmap/atlas/assemble.h"
#include "lightmap/atlas/density_search.h"
#include "lightmap/atlas/object_layouts.h"
#include "lightmap/atlas/scene_charts.h"
#include "lightmap/atlas/scene_uvs.h"
#include "lightmap/atlas/uv_rounding.h"
#include "scene/base/parallel.h"
#include "scene/base/process_memory.h"
#include "scene/base/stopwatch.h"

namespace lumel {
namespace {

std::string figures(const UvReport& r) {
  if (!r.present) return "has no TEXCOORD_1";
  char text[200];
  if (r.outOfRangeVertices == 0 && r.isTooNarrow()) {
    std::snprintf(text, sizeof text, "all UVs lie within %.2g texels of the page", r.extentTexels);
    return text;
  }
  std::snprintf(text, sizeof text,
                "%zu vertices outside 0..1, %.1f of %.1f texels covered twice, %zu triangles without area",
                r.outOfRangeVertices, r.overlapTexels, r.coveredTexels, r.zeroAreaTriangles);
  return text;
}

class AtlasBuilder {
 public:
  AtlasBuilder(const Scene& scene, const AtlasOptions& options, Progress& progress)
      : scene_(scene), options_(options), progress_(progress) {}

  Expected<AtlasResult> build() {
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      const auto& primitives = scene_.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
      if (std::any_of(primitives.begin(), primitives.end(),
                      [&](const Primitive& p) { return receivesLight(scene_, instance, p); }))
        receivers_.push_back(static_cast<int>(i));
    }
    placed_.resize(scene_.instances.size());
    if (Expected<void> used = useSceneUvs(); !used) return used.error();
    if (Expected<void> generated = generateCharts(); !generated) return generated.error();
    returnFreeMemory();  // of many small charts, before surfaces take large arrays
    makeAllSurfaces();
    return std::move(result_);
  }

 private:
  Expected<void> useSceneUvs() {
    const SceneUvs uvs = examineSceneUvs(scene_, receivers_, options_);
    AtlasReport& report = result_.report;
    report.sceneUvs = uvs.reports;
    for (const SceneUvUse& use : uvs.uses) {
      if (use.used) {
        placed_[static_cast<std::size_t>(use.instance)] =
            placeSceneUvs(scene_, use.instance, use.page, options_.pageSize, result_.atlas,
                          report.sceneUvs[static_cast<std::size_t>(use.report)]);
      } else {
        generated_.push_back(use.instance);
      }
      if (progress_.cancelled()) return interrupted();
    }
    for (const UvReport& uv : report.sceneUvs) {
      if (!uv.valid && options_.uvSource == UvSource::Scene)
        return inputError("'" + uv.mesh + "': lightmap UVs cannot be used: " + figures(uv) +
                          "; use --uv auto or generate");
      if (!uv.valid && options_.uvSource != UvSource::AsGiven)
        report.warnings.push_back("'" + uv.mesh + "': TEXCOORD_1 is not valid (" + figures(uv) +
                                  "): charts are generated");
      if (uv.frameCrossingTexels > 0)
        report.warnings.push_back("'" + uv.mesh + "': " + std::to_string(uv.frameCrossingTexels) +
                                  " texels lie in charts that cross a break of the material's tangent frame");
    }
    sceneDensity_ = meanDensity();
    result_.atlas.pages.assign(static_cast<std::size_t>(uvs.pageCount), {options_.pageSize, options_.pageSize});
    return {};
  }

  /// The density of the scene's own lightmaps, weighted by area; 0 without any.
  double meanDensity() const {
    double sum = 0, area = 0;
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      if (placed_[i].empty()) continue;
      const double surface = weightedArea(scene_, scene_.instances[i]);
      double texels = 0;
      for (const PlacedTriangle& t : placed_[i])
        texels += triangleArea(Vec2d(t.uvs[0]), t.uvs[1], t.uvs[2]) * options_.pageSize * options_.pageSize;
      sum += texels;
      area += surface;
    }
    return area > 0 ? std::sqrt(sum / area) : 0.0;
  }

  /// Charts of a density that is far too high would take minutes to be found too large for a page. Twice a page's
  /// diagonal is more than any chart may squeeze a triangle by.
  Expected<void> checkDensity(double density) const {
    for (const int i : generated_) {
      const Instance& instance = scene_.instances[static_cast<std::size_t>(i)];
      const double texels = density * weightedLength(scene_, instance);
      if (texels > 3.0 * options_.pageSize)
        return usageError("'" + instance.name + "' has a triangle that is " + std::to_string(std::llround(texels)) +
                          " texels long, a page has " + std::to_string(options_.pageSize) +
                          "; take a larger --page-size or a lower density");
    }
    return {};
  }

  Expected<void> generateCharts() {
    if (generated_.empty()) return {};
    double area = 0;
    for (const int i : generated_) area += weightedArea(scene_, scene_.instances[static_cast<std::size_t>(i)]);
    const bool search = !(options_.texelsPerMeter > 0);
    const RememberedLayout* earlier = usableLayout();
    const double density = earlier  ? earlier->chartDensity
                           : search ? guessDensity(area, options_.pageSize)
                                    : static_cast<double>(options_.texelsPerMeter);
    if (!(area > 0) || !std::isfinite(density)) return {};  // nothing has a surface

    if (!search)
      if (auto fits = checkDensity(density); !fits) return fits;

    const Stopwatch chartTime;
    UnwrapOptions unwrapOptions;
    unwrapOptions.maxStretch = static_cast<double>(options_.maxStretch);
    const int border = 2 * ((options_.padding + 1) / 2);
    unwrapOptions.largestSide = std::max(1.0, options_.pageSize - border - 1.0) * (search ? kSearchHeadroom : 1.0);
    progress_.begin("charts", receivers_.size());
    const ObjectLayouts objects = layOutObjects(scene_, generated_, density, unwrapOptions, progress_);
    progress_.end();
    if (progress_.cancelled()) return interrupted();
    AtlasReport& report = result_.report;
    report.chartSeconds = chartTime.seconds();

    const Stopwatch packTime;
    const std::vector<std::uint64_t> keys = chartKeys(scene_, objects);
    KeptLayout kept;
    if (earlier) kept = {earlier->scale, recall(*earlier, keys)};
    Expected<ChartPlaces> places =
        placeCharts(objects, options_, sceneDensity_ / density, earlier ? &kept : nullptr, progress_);
    if (!places) return places.error();
    report.packSeconds = packTime.seconds();
    result_.atlas.texelsPerMeter = static_cast<float>(density * places->scale);
    result_.atlas.chartDensity = density;
    result_.atlas.chartScale = places->scale;
    result_.atlas.sceneUvPages = static_cast<int>(result_.atlas.pages.size());
    for (const LayoutUse& use : objects.uses) {
      const Unwrapped& unwrapped = objects.layouts[use.layout].unwrapped;
      report.nonManifoldEdges += unwrapped.nonManifoldEdges;
      report.degenerateTriangles += unwrapped.degenerateTriangles;
      report.generatedCharts += unwrapped.charts.size();
    }
    takePlaces(objects, *places, keys);
    const bool hadSome =
        std::any_of(kept.charts.begin(), kept.charts.end(), [](const auto& c) { return c.has_value(); });
    if (earlier && report.keptCharts == 0 && report.generatedCharts > 0)
      report.warnings.push_back(std::string("the earlier layout ") +
                                (hadSome ? "has no room for what changed" : "holds no chart of this scene") +
                                ": all charts are placed anew" +
                                (hadSome ? "; bakes with --texels-per-meter add a page instead" : ""));
    return {};
  }

  /// The earlier layout, if it was made by the same rules.
  const RememberedLayout* usableLayout() {
    if (!options_.layout) return nullptr;
    const RememberedLayout& earlier = *options_.layout;
    const auto isClose = [](double a, double b) { return std::abs(a - b) <= 1e-6 * b; };
    const char* differs = earlier.pageSize != options_.pageSize       ? "page size"
                          : earlier.padding != options_.padding       ? "padding"
                          : earlier.blockAlign != options_.blockAlign ? "block alignment"
                          : earlier.maxStretch != options_.maxStretch ? "stretch limit"
                          : options_.texelsPerMeter > 0 && !isClose(earlier.chartDensity * earlier.scale,
                                                                    static_cast<double>(options_.texelsPerMeter))
                              ? "texel density"
                              : nullptr;
    if (!differs) return &earlier;
    result_.report.warnings.push_back(std::string("the earlier layout has another ") + differs +
                                      ": all charts are placed anew");
    return nullptr;
  }

  void takePlaces(const ObjectLayouts& objects, const ChartPlaces& places, const std::vector<std::uint64_t>& keys) {
    Atlas& atlas = result_.atlas;
    const int firstPage = static_cast<int>(atlas.pages.size());
    for (const auto& size : places.pages) atlas.pages.push_back({size[0], size[1]});
    std::size_t shape = 0;
    double keptTexels = 0, texels = 0;
    for (const LayoutUse& use : objects.uses) {
      const ObjectLayout& layout = objects.layouts[use.layout];
      const Instance& instance = scene_.instances[static_cast<std::size_t>(use.instance)];
      std::vector<PlacedTriangle>& placed = placed_[static_cast<std::size_t>(use.instance)];
      std::size_t triangles = placed.size();
      for (const UnwrappedChart& chart : layout.unwrapped.charts) triangles += chart.triangles.size();
      placed.reserve(triangles);
      const bool mirrors = glm::determinant(Mat3(instance.worldFromObject)) < 0;
      for (const UnwrappedChart& chart : layout.unwrapped.charts) {
        const std::uint64_t key = keys[shape];
        const ChartPlace& place = places.charts[shape++];
        const auto index = static_cast<std::uint32_t>(atlas.charts.size());
        const double snap = std::sqrt(place.scale.x * place.scale.y) / (use.scale * places.scale);
        atlas.charts.push_back({-1,
                                atlas.texelsPerMeter * instance.settings.texelDensityScale * static_cast<float>(snap),
                                key, place.quarterTurns, place.x, place.y});
        if (place.kept) ++result_.report.keptCharts;
        const auto& page = places.pages[static_cast<std::size_t>(place.page)];
        const Vec2d size(page[0], page[1]);
        std::vector<Vec2> uvs;
        for (const Vec2 uv : chart.uvs) uvs.push_back(Vec2(place.apply(uv) / size));
        keepAreasAfterRounding(uvs, chart.corners, size);
        for (std::size_t t = 0; t < chart.triangles.size(); ++t) {
          const SourceTriangle source = layout.source[chart.triangles[t]];
          PlacedTriangle triangle{source.primitive, source.triangle, firstPage + place.page, index, {}};
          std::array<Vec2d, 3> corners;
          for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t corner = mirrors && k > 0 ? 3 - k : k;  // the soup was reversed
            triangle.uvs[corner] = uvs[chart.corners[t][k]];
            corners[k] = Vec2d(triangle.uvs[corner]) * size;
          }
          const double area = triangleArea(corners[0], corners[1], corners[2]);
          texels += area;
          keptTexels += place.kept ? area : 0.0;
          placed.push_back(triangle);
        }
      }
      std::sort(placed.begin(), placed.end(), [](const PlacedTriangle& a, const PlacedTriangle& b) {
        return a.primitive != b.primitive ? a.primitive < b.primitive : a.triangle < b.triangle;
      });
    }
    if (texels > 0) result_.report.keptShare = keptTexels / texels;
  }

  void makeAllSurfaces() {
    std::vector<std::vector<Surface>> made(placed_.size());
    parallelFor(placed_.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) made[i] = makeSurfaces(scene_, static_cast<int>(i), placed_[i]);
    });
    Atlas& atlas = result_.atlas;
    for (std::vector<Surface>& surfaces : made)
      for (Surface& surface : surfaces) {
        for (const std::uint32_t chart : surface.charts)
          if (atlas.charts[chart].surface < 0) atlas.charts[chart].surface = static_cast<int>(atlas.surfaces.size());
        atlas.surfaces.push_back(std::move(surface));
      }
  }

  const Scene& scene_;
  const AtlasOptions& options_;
  Progress& progress_;
  std::vector<int> receivers_;
  std::vector<int> generated_;
  double sceneDensity_ = 0.0;
  std::vector<std::vector<PlacedTriangle>> placed_;  // per instance of the scene
  AtlasResult result_;
};

}  // namespace

Expected<AtlasResult> buildAtlas(const Scene& scene, const AtlasOptions& options, Progress& progress) {
  return AtlasBuilder(scene, options, progress).build();
}

}  // namespace lumel
