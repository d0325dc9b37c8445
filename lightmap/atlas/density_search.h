// Packing of all objects' charts, at the density asked or at the one that fills a page.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "lightmap/atlas/atlas_options.h"
#include "lightmap/atlas/object_layouts.h"
#include "lightmap/pack/pack.h"

namespace lumel {

/// While the density is searched, charts are made this much smaller than the page, so that they can still be scaled up.
inline constexpr double kSearchHeadroom = 0.8;

/// Density at which `area` square metres fill a page about half.
double guessDensity(double area, int pageSize);

/// page texel = placement(scale * (u, -v) + shift).
struct ChartPlace {
  int page = 0;
  Vec2d scale{1.0};  // differs by a few percent between the axes where borders were moved to whole texels
  Vec2d shift{0.0};
  int quarterTurns = 0;
  Vec2d offset{0.0};
  int x = 0;  // of its box's corner, in texels
  int y = 0;
  bool kept = false;

  Vec2d apply(Vec2 uv) const {
    Vec2d p(uv.x * scale.x + shift.x, -uv.y * scale.y + shift.y);
    for (int i = 0; i < quarterTurns; ++i) p = Vec2d(-p.y, p.x);
    return p + offset;
  }
};

struct ChartPlaces {
  std::vector<ChartPlace> charts;         // in the order of objects.uses and their layouts' charts
  std::vector<std::array<int, 2>> pages;  // width, height
  double scale = 1.0;                     // found: multiplies the density that objects were laid out for
};

/// Where charts were in an earlier bake, and its scale. If all must fit one page and do not with every kept chart in
/// its place, only the largest keep theirs; if that fails too, all are placed anew.
struct KeptLayout {
  double scale = 1.0;
  std::vector<std::optional<KeptPlace>> charts;  // in the order of ChartPlaces::charts
};

/// `mostScale` bounds a searched density: what scene-supplied lightmaps beside it have. 0: no bound.
/// Errors: Usage (a chart larger than a page; charts too many for one page at any density), Interrupted.
Expected<ChartPlaces> placeCharts(const ObjectLayouts& objects, const AtlasOptions& options, double mostScale,
                                  const KeptLayout* kept, Progress& progress);

}  // namespace lumel
