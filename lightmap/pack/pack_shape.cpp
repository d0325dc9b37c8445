#include "lightmap/pack/pack_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lightmap/raster.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Slanted edges cover what lies this close too (in texels): UVs are rounded to float after packing.
constexpr double kEdgeMargin = 1.0 / 512;

/// Shapes whose boxes have more texels gain too little by a shift of less than one.
constexpr double kMostTexelsToShift = 16384;

bool isFiniteTriangle(const std::array<Vec2, 3>& t) {
  for (const Vec2& p : t)
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return false;
  return true;
}

bool hasArea(const std::array<Vec2, 3>& t) {
  const Vec2d a(t[0]), b(t[1]), c(t[2]);
  return (b.x - a.x) * (c.y - a.y) != (c.x - a.x) * (b.y - a.y);
}

struct Box {
  Vec2d low{std::numeric_limits<double>::infinity()};
  Vec2d high{-std::numeric_limits<double>::infinity()};
  bool hasArea = false;
};

Box boxOf(const PackShape& source) {
  Box box;
  for (const auto& triangle : source.triangles) {
    if (!isFiniteTriangle(triangle)) continue;
    for (const Vec2& p : triangle) {
      box.low = glm::min(box.low, Vec2d(p));
      box.high = glm::max(box.high, Vec2d(p));
    }
    box.hasArea = box.hasArea || hasArea(triangle);
  }
  return box;
}

/// The texels that the shape may touch once moved by `offset`.
Bitmap touchedTexels(const PackShape& source, const Vec2d& offset, const Vec2d& size) {
  Bitmap texels(static_cast<int>(size.x), static_cast<int>(size.y));
  for (const auto& triangle : source.triangles) {
    if (!isFiniteTriangle(triangle)) continue;
    std::array<Vec2d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = snapToTexelBorder(Vec2d(triangle[i]) + offset);
    forEachTexelSpan(p, {0, 0, texels.width(), texels.height()}, kEdgeMargin,
                     [&](int y, int x0, int x1) { texels.setSpan(y, x0, x1); });
  }
  return texels;
}

/// Moves the shape to the origin and marks its texels. Its box rarely ends on a texel border; of the ways to share out
/// that slack, the one that touches the fewest texels (the even one if there is no better).
void rasterise(const PackShape& source, bool shift, GridShape& shape) {
  const Box box = boxOf(source);
  if (box.low.x > box.high.x) return;
  shape.toBitmap = -box.low;
  if (!box.hasArea) return;
  const Vec2d extent = box.high - box.low;
  shape.size = glm::max(Vec2d(1.0), glm::ceil(extent - kTexelSnap));
  if (std::max(shape.size.x, shape.size.y) > kLargestPage) return;  // refused by its size
  const Vec2d slack = shape.size - extent;
  shape.toBitmap = 0.5 * slack - box.low;
  shape.texels = touchedTexels(source, shape.toBitmap, shape.size);
  const bool isBox = shape.texels.count() == static_cast<std::size_t>(shape.size.x * shape.size.y);
  if (!shift || isBox || shape.size.x * shape.size.y > kMostTexelsToShift) return;
  std::size_t fewest = shape.texels.count();
  Vec2d best(0.5);
  for (int axis = 0; axis < 2; ++axis)
    for (const double end : {0.0, 1.0}) {
      if (slack[axis] <= kTexelSnap) continue;
      Vec2d shares = best;
      shares[axis] = end;
      Bitmap texels = touchedTexels(source, shares * slack - box.low, shape.size);
      const std::size_t count = texels.count();
      if (count >= fewest) continue;
      fewest = count;
      best = shares;
      shape.toBitmap = shares * slack - box.low;
      shape.texels = std::move(texels);
    }
}

Bitmap turned(const Bitmap& texels, int quarterTurns) {
  Bitmap result = texels;
  for (int i = 0; i < quarterTurns; ++i) result = quarterTurn(result);
  return result;
}

/// The blocks of a bitmap whose margin begins on one.
Bitmap blocksOf(const Bitmap& texels, const GridSettings& settings) {
  return coarsen(inflate(texels, settings.margin), settings.block, 0, 0);
}

/// Cells that no other shape's room may share: texels grown by half the padding cannot overlap another shape's; blocks
/// have their margin.
std::size_t roomOf(const Bitmap& texels, const GridSettings& settings) {
  return settings.block > 1 ? blocksOf(texels, settings).count() : inflate(texels, settings.padding / 2).count();
}

void makeOrientations(bool mayRotate, const GridSettings& settings, GridShape& shape) {
  Bitmap texels = shape.texels;
  for (int turn = 0; turn < (mayRotate ? 4 : 1); ++turn) {
    if (turn > 0) texels = quarterTurn(texels);
    const Bitmap cells = settings.block > 1 ? blocksOf(texels, settings) : texels;
    SearchMask mask = searchMask(cells);
    const bool known = std::any_of(shape.orientations.begin(), shape.orientations.end(),
                                   [&](const Orientation& o) { return o.mask.hash == mask.hash; });
    if (turn == 0) {
      shape.cells = cells.count();
      shape.room = roomOf(texels, settings);
    }
    if (!known) shape.orientations.push_back({turn, std::move(mask)});
  }
}

}  // namespace

GridSettings gridSettings(int pageSize, int padding, int blockAlign) {
  GridSettings settings;
  settings.block = std::max(1, blockAlign);
  settings.padding = std::max(0, padding);
  const int half = (settings.padding + 1) / 2;
  (settings.block > 1 ? settings.margin : settings.border) = half;
  settings.pageCells = pageSize / settings.block;
  return settings;
}

std::vector<GridShape> rasteriseShapes(std::span<const PackShape> sources) {
  std::vector<GridShape> shapes(sources.size());
  parallelFor(sources.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) rasterise(sources[i], true, shapes[i]);
  });
  return shapes;
}

Vec2d snapFactors(const PackShape& source, const GridSettings& settings) {
  const Box box = boxOf(source);
  if (!box.hasArea) return Vec2d(1.0);
  const Vec2d extent = box.high - box.low;
  const auto factor = [&settings](double side) {
    const double around = 2.0 * settings.margin;
    const double whole = std::floor((side + around) / settings.block) * settings.block - around;
    const bool isSmall = whole >= 1 && whole < side - kTexelSnap && whole >= (1 - kMostSnap) * side;
    return isSmall ? whole / side : 1.0;
  };
  const Vec2d factors(factor(extent.x), factor(extent.y));
  const auto roomAt = [&](const Vec2d& scale) {
    PackShape scaled = source;
    for (auto& triangle : scaled.triangles)
      for (Vec2& p : triangle) p = Vec2(Vec2d(p) * scale);
    GridShape shape;
    rasterise(scaled, false, shape);
    return shape.texels.empty() ? 0.0 : static_cast<double>(roomOf(shape.texels, settings));
  };
  Vec2d best(1.0);
  double gain = 0;
  double room = 0;
  for (const Vec2d scale : {Vec2d(factors.x, 1), Vec2d(1, factors.y), factors}) {
    if (scale == Vec2d(1.0)) continue;
    if (room == 0) room = roomAt(Vec2d(1.0));
    if (room == 0) return best;  // larger than any page: refused later
    const double saved = 1 - roomAt(scale) / room;
    const double lost = 1 - scale.x * scale.y;
    if (saved - lost <= gain) continue;
    gain = saved - lost;
    best = scale;
  }
  return best;
}

void addOrientations(std::span<const PackShape> sources, const GridSettings& settings, std::vector<GridShape>& shapes) {
  parallelFor(shapes.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      if (!shapes[i].texels.empty()) makeOrientations(sources[i].mayRotate, settings, shapes[i]);
  });
}

Taken takenBy(const GridShape& shape, int quarterTurns, const GridSettings& settings) {
  const Bitmap texels = turned(shape.texels, quarterTurns);
  if (settings.block > 1) return {blocksOf(texels, settings), 0};
  return {inflate(texels, settings.padding), settings.padding};
}

}  // namespace lumel
