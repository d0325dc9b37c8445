#include "lightmap/atlas/density_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "lightmap/pack/pack_shape.h"
#include "lightmap/raster.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

class Placer {
 public:
  Placer(const ObjectLayouts& objects, const AtlasOptions& options, Progress& progress)
      : objects_(objects), options_(options), progress_(progress) {}

  /// `keptShare`: of the surface of kept charts, the largest of them make up so much; the others find new places.
  Expected<ChartPlaces> placeAt(double scale, bool onePage, const KeptLayout* kept = nullptr, double keptShare = 1.0) {
    ChartPlaces places;
    places.scale = scale;
    std::vector<PackShape> shapes = makeShapes(scale, places.charts);
    if (kept) keepLargest(*kept, keptShare, shapes);
    PackOptions pack;
    pack.pageSize = options_.pageSize;
    pack.maxPages = onePage ? 1 : 0;
    pack.padding = options_.padding;
    pack.blockAlign = options_.blockAlign;
    pack.shrinkLast = !onePage;
    Expected<PackResult> packed = packCharts(shapes, pack, progress_);
    if (!packed) return packed.error();
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Placement& placement = packed->placements[i];
      if (placement.page < 0) return usageError("not all charts fit");
      places.charts[i].page = placement.page;
      places.charts[i].quarterTurns = placement.quarterTurns;
      places.charts[i].offset = Vec2d(placement.offset);
      places.charts[i].x = placement.x;
      places.charts[i].y = placement.y;
      places.charts[i].kept = placement.kept;
    }
    places.pages = std::move(packed->pages);
    return places;
  }

  /// The largest density, up to mostScale, at which everything fits one page, to 1 %.
  Expected<ChartPlaces> fillOnePage(double mostScale) {
    constexpr double kStep = 1.2;
    constexpr double kPrecision = 1.01;
    constexpr int kMostAttempts = 40;
    std::optional<ChartPlaces> best;
    double fits = 0, tooLarge = 0;
    double scale = std::min(kStep, mostScale);  // the charts' own density, half of a page, nearly always fits
    for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
      Expected<ChartPlaces> places = placeAt(scale, true);
      if (places) {
        best = std::move(*places);
        fits = scale;
      } else if (places.error().kind == ErrorKind::Interrupted) {
        return places.error();
      } else {
        tooLarge = scale;
      }
      if (fits >= mostScale || (fits > 0 && tooLarge > 0 && tooLarge < fits * kPrecision)) break;
      if (fits > 0 && tooLarge > 0)
        scale = std::sqrt(fits * tooLarge);
      else
        scale = fits > 0 ? std::min(scale * kStep, mostScale) : scale / kStep;
    }
    if (best) return std::move(*best);
    return usageError("the charts do not fit one page of " + std::to_string(options_.pageSize) +
                      " texels at any density; give --texels-per-meter for several pages, or a larger --page-size");
  }

 private:
  /// Every chart at the density, its borders on whole texels where that saves room, and where it starts from.
  std::vector<PackShape> makeShapes(double scale, std::vector<ChartPlace>& places) const {
    struct Source {
      const UnwrappedChart* chart;
      double scale;
      std::uint32_t group;
      bool mayRotate;
    };
    std::vector<Source> sources;
    for (std::size_t u = 0; u < objects_.uses.size(); ++u) {
      const ObjectLayout& layout = objects_.layouts[objects_.uses[u].layout];
      for (const UnwrappedChart& chart : layout.unwrapped.charts)
        sources.push_back({&chart, objects_.uses[u].scale * scale, static_cast<std::uint32_t>(u), !layout.own});
    }
    places.resize(sources.size());
    std::vector<PackShape> shapes(sources.size());
    const GridSettings grid = gridSettings(options_.pageSize, options_.padding, options_.blockAlign);
    parallelFor(sources.size(), 16, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const Source& source = sources[i];
        const PackShape plain = shapeOf(*source.chart, start(*source.chart, Vec2d(source.scale)), source.group);
        places[i] = start(*source.chart, source.scale * snapFactors(plain, grid));
        shapes[i] = shapeOf(*source.chart, places[i], source.group);
        shapes[i].mayRotate = source.mayRotate;
      }
    });
    return shapes;
  }

  static void keepLargest(const KeptLayout& kept, double share, std::vector<PackShape>& shapes) {
    std::vector<std::pair<double, std::size_t>> areas;
    double sum = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (!kept.charts[i]) continue;
      double area = 0;
      for (const auto& t : shapes[i].triangles) area += triangleArea(Vec2d(t[0]), t[1], t[2]);
      areas.emplace_back(-area, i);
      sum += area;
    }
    std::sort(areas.begin(), areas.end());
    double held = 0;
    for (const auto& [area, i] : areas) {
      if (held > share * sum) break;
      shapes[i].keep = kept.charts[i];
      held -= area;
    }
  }

  static ChartPlace start(const UnwrappedChart& chart, const Vec2d& scale) {
    ChartPlace place;
    place.scale = scale;
    Vec2d high(0.0);  // the chart's own coordinates start at 0
    for (const Vec2 uv : chart.uvs) high = glm::max(high, Vec2d(uv) * scale);
    // Centred in the whole texels that it needs: a chart of one texel's size lies in one texel, not across four.
    const Vec2d cells = glm::max(glm::ceil(high - kTexelSnap), Vec2d(1.0));
    place.shift = Vec2d((cells.x - high.x) / 2, cells.y - (cells.y - high.y) / 2);
    return place;
  }

  static PackShape shapeOf(const UnwrappedChart& chart, const ChartPlace& place, std::uint32_t group) {
    PackShape shape;
    shape.group = group;
    shape.triangles.reserve(chart.corners.size());
    for (const auto& corners : chart.corners)
      shape.triangles.push_back({Vec2(place.apply(chart.uvs[corners[0]])), Vec2(place.apply(chart.uvs[corners[1]])),
                                 Vec2(place.apply(chart.uvs[corners[2]]))});
    return shape;
  }

  const ObjectLayouts& objects_;
  const AtlasOptions& options_;
  Progress& progress_;
};

}  // namespace

double guessDensity(double area, int pageSize) {
  constexpr double kShare = 0.5;
  return std::sqrt(kShare * pageSize * pageSize / area);
}

Expected<ChartPlaces> placeCharts(const ObjectLayouts& objects, const AtlasOptions& options, double mostScale,
                                  const KeptLayout* kept, Progress& progress) {
  Placer placer(objects, options, progress);
  const bool search = !(options.texelsPerMeter > 0);
  if (kept)
    for (const double share : {1.0, 0.95, 0.8, 0.6}) {
      Expected<ChartPlaces> places = placer.placeAt(kept->scale, search, kept, share);
      if (places || places.error().kind != ErrorKind::Usage) return places;
    }
  if (!search) return placer.placeAt(kept ? kept->scale : 1.0, false);
  return placer.fillOnePage(mostScale > 0 ? mostScale : std::numeric_limits<double>::infinity());
}

}  // namespace lumel
