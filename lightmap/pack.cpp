// Bottom-left packing of true shapes as bitmaps, large ones first, so that small ones fill the holes between them.
#include "lightmap/pack.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <unordered_map>

#include "lightmap/bitmap.h"
#include "lightmap/pack_grid.h"
#include "lightmap/raster.h"
#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

/// Slanted edges cover what lies this close too (in texels): UVs are rounded to float after packing.
constexpr double kEdgeMargin = 1.0 / 512;

constexpr int kLargestPage = 32767;

/// A page stays open for charts of further groups until this share of it is covered.
constexpr double kCoverageGoal = 0.85;

/// One of a shape's four orientations on the grid of cells (texels, or blocks with blockAlign).
struct Orientation {
  int quarterTurns = 0;
  SearchMask mask;
};

struct Shape {
  Bitmap texels;          // as given, moved so that its box starts at (0, 0); empty: no area
  Vec2d toBitmap{0, 0};   // added to the shape's points to get there
  Vec2d size{0, 0};       // of its box in whole texels; 0: no area
  std::size_t cells = 0;  // that its mask covers
  std::size_t room = 0;   // cells that no other shape's `room` may share
  std::vector<Orientation> orientations;
};

struct Settings {
  int block = 1;    // texels per cell side
  int border = 0;   // cells
  int padding = 0;  // texels
  int pageCells = 0;
};

bool isFiniteTriangle(const std::array<Vec2, 3>& t) {
  for (const Vec2& p : t)
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return false;
  return true;
}

bool hasArea(const std::array<Vec2, 3>& t) {
  const Vec2d a(t[0]), b(t[1]), c(t[2]);
  return (b.x - a.x) * (c.y - a.y) != (c.x - a.x) * (b.y - a.y);
}

/// Moves the shape to the origin with its slack (the part of its last texels that it does not use) even on both
/// sides, and marks the texels that it may touch.
void rasterise(const PackShape& source, Shape& shape) {
  Vec2d low(std::numeric_limits<double>::infinity());
  Vec2d high(-std::numeric_limits<double>::infinity());
  bool anyArea = false;
  for (const auto& triangle : source.triangles) {
    if (!isFiniteTriangle(triangle)) continue;
    for (const Vec2& p : triangle) {
      low = glm::min(low, Vec2d(p));
      high = glm::max(high, Vec2d(p));
    }
    anyArea = anyArea || hasArea(triangle);
  }
  if (low.x > high.x) return;
  shape.toBitmap = -low;
  if (!anyArea) return;
  const Vec2d size = high - low;
  const Vec2d texels = glm::max(Vec2d(1.0), glm::ceil(size - kTexelSnap));
  shape.toBitmap += 0.5 * (texels - size);
  shape.size = texels;
  if (std::max(texels.x, texels.y) > kLargestPage) return;  // refused by its size
  shape.texels = Bitmap(static_cast<int>(texels.x), static_cast<int>(texels.y));
  for (const auto& triangle : source.triangles) {
    if (!isFiniteTriangle(triangle)) continue;
    std::array<Vec2d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = snapToTexelBorder(Vec2d(triangle[i]) + shape.toBitmap);
    forEachTexelSpan(p, {0, 0, shape.texels.width(), shape.texels.height()}, kEdgeMargin,
                     [&](int y, int x0, int x1) { shape.texels.setSpan(y, x0, x1); });
  }
}

Bitmap turned(const Bitmap& texels, int quarterTurns) {
  Bitmap result = texels;
  for (int i = 0; i < quarterTurns; ++i) result = quarterTurn(result);
  return result;
}

void makeOrientations(bool mayRotate, const Settings& settings, Shape& shape) {
  Bitmap texels = shape.texels;
  for (int turn = 0; turn < (mayRotate ? 4 : 1); ++turn) {
    if (turn > 0) texels = quarterTurn(texels);
    const Bitmap cells = settings.block > 1 ? coarsen(texels, settings.block, 0, 0) : texels;
    SearchMask mask = searchMask(cells);
    const bool known = std::any_of(shape.orientations.begin(), shape.orientations.end(),
                                   [&](const Orientation& o) { return o.mask.hash == mask.hash; });
    if (turn == 0) {
      shape.cells = cells.count();
      // Texels grown by half the padding cannot overlap another shape's; blocks cannot as they are.
      shape.room = settings.block > 1 ? shape.cells : inflate(texels, settings.padding / 2).count();
    }
    if (!known) shape.orientations.push_back({turn, std::move(mask)});
  }
}

/// What a placed shape keeps others out of, and where that bitmap's corner lies relative to the shape's.
struct Taken {
  Bitmap cells;
  int margin = 0;
};

Taken takenBy(const Shape& shape, int quarterTurns, const Settings& settings) {
  const Bitmap grown = inflate(turned(shape.texels, quarterTurns), settings.padding);
  if (settings.block == 1) return {grown, settings.padding};
  const int margin = (settings.padding + settings.block - 1) / settings.block;
  const int origin = margin * settings.block - settings.padding;
  return {coarsen(grown, settings.block, origin, origin), margin};
}

struct Place {
  int orientation = 0;
  Cell cell;
};

/// A page being filled.
class PagePacker {
 public:
  PagePacker(const Settings& settings, int width, int height)
      : settings_(settings), grid_(width, height, settings.border) {}

  /// Puts the shape where its upper edge comes lowest; false: it fits nowhere.
  bool place(const Shape& shape, Place* place) {
    int bestTop = std::numeric_limits<int>::max();
    for (std::size_t i = 0; i < shape.orientations.size(); ++i) {
      const SearchMask& mask = shape.orientations[i].mask;
      // Cells are never given back, so where this very mask did not fit before it does not fit now.
      int& firstRow = firstRow_[mask.hash];
      const int lastRow = bestTop == std::numeric_limits<int>::max() ? grid_.height() : bestTop - 1 - mask.height;
      const auto cell = grid_.findFirst(mask, firstRow, lastRow);
      firstRow = std::max(firstRow, cell ? cell->y : lastRow + 1);
      if (!cell) continue;
      bestTop = cell->y + mask.height;
      *place = {static_cast<int>(i), *cell};
    }
    if (bestTop == std::numeric_limits<int>::max()) return false;
    const int turns = shape.orientations[static_cast<std::size_t>(place->orientation)].quarterTurns;
    const Taken taken = takenBy(shape, turns, settings_);
    grid_.insert(taken.cells, place->cell.x - taken.margin, place->cell.y - taken.margin);
    covered_ += shape.cells;
    return true;
  }

  std::size_t freeCells() const { return grid_.freeCells(); }
  double coverage() const {
    return static_cast<double>(covered_) / (static_cast<double>(grid_.width()) * grid_.height());
  }

 private:
  Settings settings_;
  PackGrid grid_;
  std::unordered_map<std::uint64_t, int> firstRow_;  // by mask hash; looked up only, never walked
  std::size_t covered_ = 0;
};

/// Page coordinates from shape coordinates for a bitmap turned and put at `cell`.
Placement placementOf(const Shape& shape, const Place& place, int page, int block) {
  const int turns = shape.orientations[static_cast<std::size_t>(place.orientation)].quarterTurns;
  const double w = shape.texels.width();
  const double h = shape.texels.height();
  const std::array<Vec2d, 4> back = {Vec2d(0, 0), Vec2d(h, 0), Vec2d(w, h), Vec2d(0, w)};
  Vec2d offset = shape.toBitmap;
  for (int i = 0; i < turns; ++i) offset = Vec2d(-offset.y, offset.x);
  offset += back[static_cast<std::size_t>(turns)] + Vec2d(place.cell.x * block, place.cell.y * block);
  return {page, turns, Vec2(offset)};
}

struct Group {
  std::uint32_t id = 0;
  std::vector<std::uint32_t> shapes;  // still to place, large first
  std::size_t room = 0;
  bool opened = false;  // some of its shapes lie on an earlier page
};

class AtlasPacker {
 public:
  AtlasPacker(std::vector<Shape> shapes, const Settings& settings, const PackOptions& options, Progress& progress)
      : shapes_(std::move(shapes)), settings_(settings), options_(options), progress_(progress) {
    places_.resize(shapes_.size());
    pageOf_.assign(shapes_.size(), -1);
  }

  Expected<PackResult> run(std::span<const PackShape> sources);

 private:
  bool larger(std::uint32_t a, std::uint32_t b) const;
  std::vector<Group> makeGroups(std::span<const PackShape> sources) const;
  std::vector<std::uint32_t> selectForPage(std::vector<Group>& groups) const;
  void fillPage(std::vector<Group>& groups, int page);
  bool packAll(std::vector<std::uint32_t> order, int width, int height, int page);
  void placeInto(PagePacker& packer, Group& group, int page);
  void shrinkLastPage();
  std::size_t roomOf(const std::vector<std::uint32_t>& shapes) const;

  std::vector<Shape> shapes_;
  Settings settings_;
  PackOptions options_;
  Progress& progress_;
  std::vector<Place> places_;
  std::vector<int> pageOf_;
  std::vector<std::array<int, 2>> pages_;  // cells
};

bool AtlasPacker::larger(std::uint32_t a, std::uint32_t b) const {
  const auto key = [&](std::uint32_t i) {
    const Bitmap& t = shapes_[i].texels;
    return std::array<std::size_t, 3>{static_cast<std::size_t>(std::max(t.width(), t.height())),
                                      static_cast<std::size_t>(std::min(t.width(), t.height())), shapes_[i].cells};
  };
  const auto keyA = key(a);
  const auto keyB = key(b);
  return keyA != keyB ? keyA > keyB : a < b;
}

std::size_t AtlasPacker::roomOf(const std::vector<std::uint32_t>& shapes) const {
  std::size_t sum = 0;
  for (const std::uint32_t i : shapes) sum += shapes_[i].room;
  return sum;
}

std::vector<Group> AtlasPacker::makeGroups(std::span<const PackShape> sources) const {
  std::unordered_map<std::uint32_t, std::size_t> indexOf;  // looked up only
  std::vector<Group> groups;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i) {
    if (shapes_[i].texels.empty()) continue;
    const auto [entry, isNew] = indexOf.try_emplace(sources[i].group, groups.size());
    if (isNew) groups.push_back({sources[i].group, {}, 0, false});
    Group& group = groups[entry->second];
    group.shapes.push_back(i);
    group.room += shapes_[i].room;
  }
  for (Group& group : groups)
    std::sort(group.shapes.begin(), group.shapes.end(), [&](auto a, auto b) { return larger(a, b); });
  std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.room > b.room; });
  return groups;
}

/// Whole groups for the next page: those already begun first, then the largest that its room still holds; where even
/// one group is too much for a page, that group.
std::vector<std::uint32_t> AtlasPacker::selectForPage(std::vector<Group>& groups) const {
  const std::size_t page =
      static_cast<std::size_t>(settings_.pageCells) * static_cast<std::size_t>(settings_.pageCells);
  std::size_t sum = 0;
  std::vector<std::uint32_t> selected;
  const auto take = [&](Group& group) {
    selected.insert(selected.end(), group.shapes.begin(), group.shapes.end());
    sum += group.room;
    group.opened = true;
  };
  for (Group& group : groups)
    if (group.opened) take(group);
  for (Group& group : groups)
    if (!group.opened && (sum == 0 || sum + group.room <= page)) take(group);
  std::sort(selected.begin(), selected.end(), [&](auto a, auto b) { return larger(a, b); });
  return selected;
}

void AtlasPacker::placeInto(PagePacker& packer, Group& group, int page) {
  for (const std::uint32_t i : group.shapes) {
    if (progress_.cancelled()) return;
    if (packer.place(shapes_[i], &places_[i])) {
      pageOf_[i] = page;
      group.opened = true;
      progress_.advance(1);
    }
  }
}

void AtlasPacker::fillPage(std::vector<Group>& groups, int page) {
  PagePacker packer(settings_, settings_.pageCells, settings_.pageCells);
  Group selected;
  selected.shapes = selectForPage(groups);
  placeInto(packer, selected, page);
  for (Group& group : groups) {
    if (progress_.cancelled() || packer.coverage() >= kCoverageGoal) break;
    if (!group.opened) placeInto(packer, group, page);
  }
  for (Group& group : groups) {
    std::erase_if(group.shapes, [&](std::uint32_t i) { return pageOf_[i] >= 0; });
    group.room = roomOf(group.shapes);
  }
  std::erase_if(groups, [](const Group& group) { return group.shapes.empty(); });
  pages_.push_back({settings_.pageCells, settings_.pageCells});
}

/// All shapes on one page, or nothing: gives up at the first one that does not fit.
bool AtlasPacker::packAll(std::vector<std::uint32_t> order, int width, int height, int page) {
  const std::size_t cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (roomOf(order) > cells) return false;
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return larger(a, b); });
  std::size_t left = 0;
  for (const std::uint32_t i : order) left += shapes_[i].cells;
  PagePacker packer(settings_, width, height);
  std::vector<Place> places(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Shape& shape = shapes_[order[k]];
    if (progress_.cancelled() || left > packer.freeCells() || !packer.place(shape, &places[k])) return false;
    left -= shape.cells;
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    places_[order[k]] = places[k];
    pageOf_[order[k]] = page;
  }
  return true;
}

void AtlasPacker::shrinkLastPage() {
  const int page = static_cast<int>(pages_.size()) - 1;
  std::vector<std::uint32_t> onPage;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i)
    if (pageOf_[i] == page) onPage.push_back(i);
  std::vector<int> sides;  // cells
  for (int texels = std::max(4, settings_.block); texels / settings_.block < settings_.pageCells; texels *= 2)
    if (texels % settings_.block == 0) sides.push_back(texels / settings_.block);
  sides.push_back(settings_.pageCells);
  std::vector<std::array<int, 2>> sizes;
  for (const int width : sides)
    for (const int height : sides) sizes.push_back({width, height});
  const auto key = [](const std::array<int, 2>& s) {
    return std::array<std::int64_t, 3>{std::int64_t{s[0]} * s[1], std::abs(s[0] - s[1]), -s[0]};
  };
  std::sort(sizes.begin(), sizes.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  sizes.pop_back();  // the full page, which is known to do
  for (const auto& size : sizes)
    if (packAll(onPage, size[0], size[1], page)) {
      pages_.back() = size;
      return;
    }
}

Expected<PackResult> AtlasPacker::run(std::span<const PackShape> sources) {
  std::vector<Group> groups = makeGroups(sources);
  while (!groups.empty() && (options_.maxPages == 0 || static_cast<int>(pages_.size()) < options_.maxPages)) {
    const int page = static_cast<int>(pages_.size());
    if (page + 1 == options_.maxPages) {
      std::vector<std::uint32_t> rest;
      for (const Group& group : groups) rest.insert(rest.end(), group.shapes.begin(), group.shapes.end());
      if (!packAll(rest, settings_.pageCells, settings_.pageCells, page)) break;
      pages_.push_back({settings_.pageCells, settings_.pageCells});
      groups.clear();
    } else {
      fillPage(groups, page);
    }
    if (progress_.cancelled()) return interrupted();
  }
  if (progress_.cancelled()) return interrupted();
  if (!shapes_.empty() && pages_.empty()) pages_.push_back({settings_.pageCells, settings_.pageCells});
  if (options_.shrinkLast && groups.empty() && !pages_.empty()) shrinkLastPage();
  if (progress_.cancelled()) return interrupted();

  PackResult result;
  result.placements.resize(shapes_.size());
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    if (shapes_[i].texels.empty())
      result.placements[i] = {0, 0, Vec2(shapes_[i].toBitmap + Vec2d(settings_.border * settings_.block))};
    else if (pageOf_[i] >= 0)
      result.placements[i] = placementOf(shapes_[i], places_[i], pageOf_[i], settings_.block);
  }
  for (const auto& page : pages_) {
    const auto texels = [&](int cells) {
      return cells == settings_.pageCells ? options_.pageSize : cells * settings_.block;
    };
    result.pages.push_back({texels(page[0]), texels(page[1])});
  }
  return result;
}

Expected<void> checkSizes(const std::vector<Shape>& shapes, std::span<const PackShape> sources,
                          const Settings& settings) {
  const int limit = (settings.pageCells - 2 * settings.border) * settings.block;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Vec2d size = shapes[i].size;
    if (std::max(size.x, size.y) > limit)
      return usageError("packing: chart " + std::to_string(i) + " (object " + std::to_string(sources[i].group) +
                        ") is " + std::to_string(static_cast<std::int64_t>(size.x)) + " x " +
                        std::to_string(static_cast<std::int64_t>(size.y)) + " texels, a page holds " +
                        std::to_string(std::max(0, limit)) + "; take a larger --page-size or a lower density");
  }
  return {};
}

}  // namespace

Expected<PackResult> packCharts(std::span<const PackShape> shapes, const PackOptions& options, Progress& progress) {
  if (options.pageSize < 1 || options.pageSize > kLargestPage)
    return usageError("packing: --page-size " + std::to_string(options.pageSize) + " is not in 1.." +
                      std::to_string(kLargestPage));
  Settings settings;
  settings.block = std::max(1, options.blockAlign);
  settings.padding = std::max(0, options.padding);
  settings.border = ((settings.padding + 1) / 2 + settings.block - 1) / settings.block;
  settings.pageCells = options.pageSize / settings.block;

  std::vector<Shape> prepared(shapes.size());
  parallelFor(shapes.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) rasterise(shapes[i], prepared[i]);
  });
  if (const auto fits = checkSizes(prepared, shapes, settings); !fits) return fits.error();
  parallelFor(shapes.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      if (!prepared[i].texels.empty()) makeOrientations(shapes[i].mayRotate, settings, prepared[i]);
  });
  progress.begin("packing", shapes.size());
  AtlasPacker packer(std::move(prepared), settings, options, progress);
  Expected<PackResult> result = packer.run(shapes);
  progress.end();
  return result;
}

}  // namespace lumel
