// A chart as packing sees it: bitmaps on the page's grid of cells (texels, or blocks where charts keep to blocks).
#pragma once

#include <span>
#include <vector>

#include "lightmap/pack/bitmap.h"
#include "lightmap/pack/pack.h"
#include "lightmap/pack/pack_grid.h"

namespace lumel {

inline constexpr int kLargestPage = 32767;

struct GridSettings {
  int block = 1;      // texels per cell side
  int border = 0;     // cells kept free at the page's sides
  int margin = 0;     // texels around a shape that belong to its cells, where cells are blocks
  int padding = 0;    // texels
  int pageCells = 0;  // on a side
};

/// One of the four quarter turns that has a mask of its own.
struct Orientation {
  int quarterTurns = 0;
  SearchMask mask;
};

struct GridShape {
  Bitmap texels;          // as given, moved so that its box starts at (0, 0); empty: no area
  Vec2d toBitmap{0, 0};   // added to the shape's points to get there
  Vec2d size{0, 0};       // of its box in whole texels; 0: no area
  std::size_t cells = 0;  // that its mask covers
  std::size_t room = 0;   // cells that no other shape's `room` may share
  std::vector<Orientation> orientations;
};

/// Where cells are blocks, half of the padding goes with each shape as a margin: then shapes on different blocks are
/// far enough apart, and from the page's border too.
GridSettings gridSettings(int pageSize, int padding, int blockAlign);

/// Bitmaps of all shapes, in parallel; the orientations are left out (shapes larger than a page can be refused first).
std::vector<GridShape> rasteriseShapes(std::span<const PackShape> sources);

/// Factors, at most 1, by which a shape becomes smaller along x and y so that its box ends on whole texels (with its
/// margin on whole blocks), where that saves a larger share of its room on the page than of its surface. A side changes
/// by kMostSnap at most.
Vec2d snapFactors(const PackShape& source, const GridSettings& settings);
inline constexpr double kMostSnap = 0.08;

void addOrientations(std::span<const PackShape> sources, const GridSettings& settings, std::vector<GridShape>& shapes);

/// What a placed shape keeps others out of, and where that bitmap's corner lies relative to the shape's.
struct Taken {
  Bitmap cells;
  int margin = 0;
};

Taken takenBy(const GridShape& shape, int quarterTurns, const GridSettings& settings);

}  // namespace lumel
