// Packing of chart shapes (not boxes) into atlas pages.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/math.h"
#include "scene/base/progress.h"

namespace lumel {

/// A place of before: where the upper left corner of the shape's box was, in texels, after the quarter turns.
struct KeptPlace {
  int page = 0;
  int quarterTurns = 0;
  int x = 0;
  int y = 0;
};

/// A flattened chart to place: its triangles in texels, in any position.
struct PackShape {
  std::vector<std::array<Vec2, 3>> triangles;
  std::uint32_t group = 0;             // charts of one group (object) are kept on one page where they fit
  bool mayRotate = true;               // by quarter turns; false where the tangent convention forbids it
  std::optional<KeptPlace> keep = {};  // stays there if it fits
};

struct PackOptions {
  int pageSize = 1024;
  int maxPages = 0;        // 0: as many as needed
  int padding = 2;         // texels between any two charts' covered texels, and half of it (rounded up) to the border
  int blockAlign = 0;      // no block of so many texels a side holds texels of two charts: a chart with half of the
                           // padding (rounded up) around it starts on a block; 0 = off
  bool shrinkLast = true;  // the last page gets the smallest power-of-two sides that hold its charts
};

/// Where a shape went: page texel = rotate(shape point, quarterTurns) + offset, where one quarter turn maps
/// (x, y) to (-y, x). `page` is -1 if maxPages ran out.
struct Placement {
  int page = -1;
  int quarterTurns = 0;
  Vec2 offset{0, 0};
  int x = 0;  // of its box's corner, as in KeptPlace
  int y = 0;
  bool kept = false;

  Vec2 apply(Vec2 p) const {
    for (int i = 0; i < quarterTurns; ++i) p = Vec2(-p.y, p.x);
    return p + offset;
  }
};

struct PackResult {
  std::vector<Placement> placements;      // one per shape
  std::vector<std::array<int, 2>> pages;  // width, height
};

/// Places every shape so that their conservatively rasterised texels stay `padding` apart. Deterministic.
/// Shapes with a place to keep come first; one that does not fit there (off the page, off the blocks, too near to one
/// before it) is placed like any other. The others go into the room between, on the pages that hold charts of their
/// group before others, then on new pages. A last page with kept shapes is not packed anew: its sides are only cut.
/// Errors: Usage (a shape larger than a page), Interrupted.
Expected<PackResult> packCharts(std::span<const PackShape> shapes, const PackOptions& options, Progress& progress);

}  // namespace lumel
