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

std::string nameOf(const UvReport& r) {
  std::string name = "'" + r.mesh + "'";
  if (r.instances > 1) name += " (" + std::to_string(r.instances) + " of its mesh)";
  return name;
}

/// Objects of one mesh whose own UVs have too little between their charts.
struct Margins {
  std::size_t touching = 0;
  double worstShare = 0.0;  // of an object's texels that hold two charts
};

class AtlasBuilder {
 public:
  AtlasBuilder(const Scene& scene, const AtlasOptions& options, Progress& progress)
      : scene_(scene), options_(options), progress_(progress) {}

  Expected<AtlasResult> build() {
    receivers_ = receiversOf(scene_);
    result_.atlas.places.resize(scene_.instances.size());
    placed_.resize(scene_.instances.size());
    if (Expected<void> used = useSceneUvs(); !used) return used.error();
    if (Expected<void> packed = packObjects(); !packed) return packed.error();
    warnOfSceneUvs();
    returnFreeMemory();  // of many small charts, before surfaces take large arrays
    makeAllSurfaces();
    return std::move(result_);
  }

 private:
  Expected<void> useSceneUvs() {
    const SceneUvs uvs = examineSceneUvs(scene_, receivers_, options_);
    AtlasReport& report = result_.report;
    report.sceneUvs = uvs.reports;
    report.uvChoice = describeUvChoice(uvs, options_.uvSource);
    ownUvs_.assign(scene_.meshes.size(), false);
    reportOfMesh_.assign(scene_.meshes.size(), 0);
    margins_.resize(uvs.reports.size());
    for (const UvReport& uv : report.sceneUvs)
      if (!uv.valid && options_.uvSource == UvSource::Scene)
        return inputError(nameOf(uv) + ": lightmap UVs cannot be used: " + figures(uv) +
                          "; use --uv auto, object or generate");
    for (const SceneUvUse& use : uvs.uses) {
      if (progress_.cancelled()) return interrupted();
      const auto instance = static_cast<std::size_t>(use.instance);
      if (!use.used || uvs.perObject) packed_.push_back(use.instance);
      if (!use.used) continue;
      const auto mesh = static_cast<std::size_t>(scene_.instances[instance].mesh);
      reportOfMesh_[mesh] = static_cast<std::size_t>(use.report);
      ownUvs_[mesh] = uvs.perObject;
      if (uvs.perObject) continue;
      result_.atlas.places[instance].page = use.page;
      placed_[instance] = placeSceneUvs(scene_, use.instance, result_.atlas.places[instance], Vec2d(options_.pageSize),
                                        result_.atlas, report.sceneUvs[reportOfMesh_[mesh]]);
    }
    sceneDensity_ = meanDensity();
    result_.atlas.pages.assign(static_cast<std::size_t>(uvs.pageCount), {options_.pageSize, options_.pageSize});
    return {};
  }

  /// What is wrong with the UVs of each mesh, once all are placed.
  void warnOfSceneUvs() {
    AtlasReport& report = result_.report;
    for (std::size_t i = 0; i < report.sceneUvs.size(); ++i) {
      const UvReport& uv = report.sceneUvs[i];
      const std::string name = nameOf(uv);
      if (!uv.valid && options_.uvSource != UvSource::AsGiven)
        report.warnings.push_back(name + ": TEXCOORD_1 is not valid (" + figures(uv) + "): charts are generated");
      if (uv.frameCrossingTexels > 0)
        report.warnings.push_back(name + ": " + std::to_string(uv.frameCrossingTexels) +
                                  " texels lie in charts that cross a break of the material's tangent frame");
      if (margins_[i].touching > 0)
        report.warnings.push_back(name + ": charts of TEXCOORD_1 lie less than a texel apart" +
                                  (uv.instances > 1 ? " in " + std::to_string(margins_[i].touching) + " objects" : "") +
                                  ", where light bleeds between them (at worst " +
                                  std::to_string(std::llround(100 * margins_[i].worstShare)) +
                                  "% of the texels hold two charts); take a higher density, or wider margins");
    }
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
    for (const int i : packed_) {
      const Instance& instance = scene_.instances[static_cast<std::size_t>(i)];
      if (ownUvs_[static_cast<std::size_t>(instance.mesh)]) continue;
      const double texels = density * weightedLength(scene_, instance);
      if (texels > 3.0 * options_.pageSize)
        return usageError("'" + instance.name + "' has a triangle that is " + std::to_string(std::llround(texels)) +
                          " texels long, a page has " + std::to_string(options_.pageSize) +
                          "; take a larger --page-size or a lower density");
    }
    return {};
  }

  /// Makes charts and rectangles for all that has no place on a page yet, and packs them.
  Expected<void> packObjects() {
    if (packed_.empty()) return {};
    double area = 0;
    for (const int i : packed_) area += weightedArea(scene_, scene_.instances[static_cast<std::size_t>(i)]);
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
    ObjectLayouts objects = layOutObjects(scene_, packed_, ownUvs_, density, unwrapOptions, progress_);
    if (!search) cutToPage(objects, unwrapOptions.largestSide);
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
      if (!objects.layouts[use.layout].own) report.generatedCharts += unwrapped.charts.size();
    }
    takePlaces(objects, *places, keys);
    const bool hadSome =
        std::any_of(kept.charts.begin(), kept.charts.end(), [](const auto& c) { return c.has_value(); });
    if (earlier && report.keptCharts == 0 && !kept.charts.empty())
      report.warnings.push_back(std::string("the earlier layout ") +
                                (hadSome ? "has no room for what changed" : "holds no chart of this scene") +
                                ": all charts are placed anew" +
                                (hadSome ? "; bakes with --texels-per-meter add a page instead" : ""));
    return {};
  }

  /// The rectangle of an object's own UVs cannot be split: one that is larger than a page gets fewer texels.
  void cutToPage(ObjectLayouts& objects, double largestSide) {
    for (LayoutUse& use : objects.uses) {
      const std::optional<OwnUvs>& own = objects.layouts[use.layout].own;
      if (!own) continue;
      const Vec2d size = own->size() * use.scale;
      const double longest = std::max(size.x, size.y);
      if (!(longest > largestSide)) continue;
      use.scale *= largestSide / longest;
      char text[200];
      std::snprintf(text, sizeof text,
                    ": its TEXCOORD_1 asks for %.0f x %.0f texels and a page has %d: it gets %.3g of the density; take "
                    "a larger --page-size, or --uv generate",
                    size.x, size.y, options_.pageSize, largestSide / longest);
      result_.report.warnings.push_back("'" + scene_.instances[static_cast<std::size_t>(use.instance)].name + "'" +
                                        text);
    }
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
      std::vector<PlacedTriangle>& placed = placed_[static_cast<std::size_t>(use.instance)];
      std::size_t triangles = placed.size();
      for (const UnwrappedChart& chart : layout.unwrapped.charts) triangles += chart.triangles.size();
      placed.reserve(triangles);
      for (const UnwrappedChart& chart : layout.unwrapped.charts) {
        const std::uint64_t key = keys[shape];
        const ChartPlace& place = places.charts[shape++];
        const std::size_t first = placed.size();
        const int page = firstPage + place.page;
        if (layout.own)
          placeRectangle(use.instance, *layout.own, place, page, key);
        else
          placeChart(use, layout, chart, place, page, key, places.scale);
        const Vec2d size = sizeOf(page);
        double area = 0;
        for (std::size_t i = first; i < placed.size(); ++i)
          area += triangleArea(Vec2d(placed[i].uvs[0]) * size, Vec2d(placed[i].uvs[1]) * size,
                               Vec2d(placed[i].uvs[2]) * size);
        texels += area;
        keptTexels += place.kept ? area : 0.0;
        if (place.kept) ++result_.report.keptCharts;
      }
      std::sort(placed.begin(), placed.end(), [](const PlacedTriangle& a, const PlacedTriangle& b) {
        return a.primitive != b.primitive ? a.primitive < b.primitive : a.triangle < b.triangle;
      });
    }
    if (texels > 0) result_.report.keptShare = keptTexels / texels;
  }

  Vec2d sizeOf(int page) const {
    const Page& p = result_.atlas.pages[static_cast<std::size_t>(page)];
    return {p.width, p.height};
  }

  void placeChart(const LayoutUse& use, const ObjectLayout& layout, const UnwrappedChart& chart,
                  const ChartPlace& place, int page, std::uint64_t key, double scale) {
    Atlas& atlas = result_.atlas;
    const Instance& instance = scene_.instances[static_cast<std::size_t>(use.instance)];
    const bool mirrors = glm::determinant(Mat3(instance.worldFromObject)) < 0;
    const auto index = static_cast<std::uint32_t>(atlas.charts.size());
    const double snap = std::sqrt(place.scale.x * place.scale.y) / (use.scale * scale);
    atlas.charts.push_back({-1, atlas.texelsPerMeter * instance.settings.texelDensityScale * static_cast<float>(snap),
                            key, place.quarterTurns, place.x, place.y});
    const Vec2d size = sizeOf(page);
    std::vector<Vec2> uvs;
    for (const Vec2 uv : chart.uvs) uvs.push_back(Vec2(place.apply(uv) / size));
    keepAreasAfterRounding(uvs, chart.corners, size);
    for (std::size_t t = 0; t < chart.triangles.size(); ++t) {
      const SourceTriangle source = layout.source[chart.triangles[t]];
      PlacedTriangle triangle{source.primitive, source.triangle, page, index, {}};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t corner = mirrors && k > 0 ? 3 - k : k;  // the soup was reversed
        triangle.uvs[corner] = uvs[chart.corners[t][k]];
      }
      placed_[static_cast<std::size_t>(use.instance)].push_back(triangle);
    }
  }

  /// The object's own UVs, moved into the place of their box.
  void placeRectangle(int instance, const OwnUvs& own, const ChartPlace& place, int page, std::uint64_t key) {
    Atlas& atlas = result_.atlas;
    const Vec2d size = sizeOf(page);
    const Vec2d scale = own.texelsPerUv * place.scale;
    // The chart's v runs up from the box's lower edge.
    const Vec2d corner = place.apply({0, 0}) - Vec2d(own.low.x, own.high.y) * scale;
    LightmapPlace& lies = atlas.places[static_cast<std::size_t>(instance)];
    lies = {page, Vec2(scale / size), Vec2(corner / size)};
    const std::size_t report =
        reportOfMesh_[static_cast<std::size_t>(scene_.instances[static_cast<std::size_t>(instance)].mesh)];
    const std::size_t first = atlas.charts.size();
    std::vector<PlacedTriangle>& placed = placed_[static_cast<std::size_t>(instance)];
    placed = placeSceneUvs(scene_, instance, lies, size, atlas, result_.report.sceneUvs[report]);
    ++result_.report.objectsWithOwnUvs;
    if (first == atlas.charts.size()) return;
    // The first chart of the object remembers the rectangle.
    atlas.charts[first].key = key;
    atlas.charts[first].x = place.x;
    atlas.charts[first].y = place.y;
    const OwnMargins margins = measureMargins(placed, size);
    if (!margins.touch) return;
    ++margins_[report].touching;
    margins_[report].worstShare = std::max(margins_[report].worstShare, margins.shared / margins.covered);
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
  std::vector<int> packed_;                // receivers that need a place for charts or for a rectangle of their own UVs
  std::vector<bool> ownUvs_;               // per mesh: its instances get rectangles
  std::vector<std::size_t> reportOfMesh_;  // of meshes whose UVs are used: into AtlasReport::sceneUvs
  std::vector<Margins> margins_;           // per report
  double sceneDensity_ = 0.0;
  std::vector<std::vector<PlacedTriangle>> placed_;  // per instance of the scene
  AtlasResult result_;
};

}  // namespace

Expected<AtlasResult> buildAtlas(const Scene& scene, const AtlasOptions& options, Progress& progress) {
  return AtlasBuilder(scene, options, progress).build();
}

}  // namespace lumel
