// Bottom-left packing of true shapes as bitmaps, large ones first, so that small ones fill the holes between them.
#include "lightmap/pack/pack.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <unordered_map>

#include "lightmap/pack/pack_page.h"
#include "lightmap/pack/pack_shape.h"

namespace lumel {
namespace {

/// A page stays open for charts of further groups until this share of it is covered.
constexpr double kCoverageGoal = 0.85;

/// Page coordinates from shape coordinates for a bitmap turned and put at `cell`.
Placement placementOf(const GridShape& shape, const Place& place, int page, const GridSettings& settings) {
  const int turns = shape.orientations[static_cast<std::size_t>(place.orientation)].quarterTurns;
  const double w = shape.texels.width();
  const double h = shape.texels.height();
  const std::array<Vec2d, 4> back = {Vec2d(0, 0), Vec2d(h, 0), Vec2d(w, h), Vec2d(0, w)};
  Vec2d offset = shape.toBitmap;
  for (int i = 0; i < turns; ++i) offset = Vec2d(-offset.y, offset.x);
  offset += back[static_cast<std::size_t>(turns)];
  const Cell corner{place.cell.x * settings.block + settings.margin, place.cell.y * settings.block + settings.margin};
  return {page, turns, Vec2(offset + Vec2d(corner.x, corner.y)), corner.x, corner.y};
}

/// The other way round; nothing where no such place is to be had on any page.
std::optional<Place> placeOf(const GridShape& shape, const KeptPlace& keep, const GridSettings& settings) {
  const Cell corner{keep.x - settings.margin, keep.y - settings.margin};
  if (corner.x % settings.block != 0 || corner.y % settings.block != 0) return std::nullopt;
  for (std::size_t i = 0; i < shape.orientations.size(); ++i)
    if (shape.orientations[i].quarterTurns == keep.quarterTurns)
      return Place{static_cast<int>(i), {corner.x / settings.block, corner.y / settings.block}};
  return std::nullopt;
}

struct Group {
  std::uint32_t id = 0;
  std::vector<std::uint32_t> shapes;  // still to place, large first
  std::size_t room = 0;
  bool opened = false;      // some of its shapes lie on an earlier page
  std::vector<int> keptOn;  // pages with shapes that stayed where they were
};

/// A page as it could be.
struct Filling {
  std::vector<std::pair<std::uint32_t, Place>> placed;
  double coverage = 0.0;
};

class AtlasPacker {
 public:
  AtlasPacker(std::vector<GridShape> shapes, const GridSettings& settings, const PackOptions& options,
              Progress& progress)
      : shapes_(std::move(shapes)), settings_(settings), options_(options), progress_(progress) {
    places_.resize(shapes_.size());
    pageOf_.assign(shapes_.size(), -1);
    isKept_.assign(shapes_.size(), false);
  }

  Expected<PackResult> run(std::span<const PackShape> sources);

 private:
  int keepPlaces(std::span<const PackShape> sources);
  std::vector<Group> makeGroups(std::span<const PackShape> sources) const;
  PagePacker openPage(int page) const;
  void commit(const Filling& filling, int page, std::vector<Group>& groups);
  void fillKeptPages(std::vector<Group>& groups);
  void cutLastPage();
  std::vector<std::array<int, 2>> pageSizes() const;
  std::vector<std::uint32_t> selectForPage(const std::vector<Group>& groups, std::vector<bool>& selected) const;
  Filling fillByGroups(const std::vector<Group>& groups) const;
  Filling fillBySize(const std::vector<Group>& groups) const;
  void fillPage(std::vector<Group>& groups, int page);
  bool packAll(const std::vector<std::uint32_t>& chosen, int width, int height, int page);
  void placeInto(PagePacker& packer, const std::vector<std::uint32_t>& shapes, Filling& filling) const;
  void shrinkLastPage();
  std::size_t roomOf(const std::vector<std::uint32_t>& shapes) const;

  std::vector<GridShape> shapes_;
  GridSettings settings_;
  PackOptions options_;
  Progress& progress_;
  std::vector<Place> places_;
  std::vector<int> pageOf_;
  std::vector<bool> isKept_;
  std::vector<std::array<int, 2>> pages_;  // cells
};

std::size_t AtlasPacker::roomOf(const std::vector<std::uint32_t>& shapes) const {
  std::size_t sum = 0;
  for (const std::uint32_t i : shapes) sum += shapes_[i].room;
  return sum;
}

/// Puts shapes where they were. Returns how many pages that takes.
int AtlasPacker::keepPlaces(std::span<const PackShape> sources) {
  std::vector<std::vector<std::uint32_t>> wanted;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i) {
    if (!sources[i].keep || shapes_[i].texels.empty()) continue;
    const auto page = static_cast<std::size_t>(std::max(0, sources[i].keep->page));
    if (page >= shapes_.size() || (options_.maxPages > 0 && page >= static_cast<std::size_t>(options_.maxPages)))
      continue;
    if (page >= wanted.size()) wanted.resize(page + 1);
    wanted[page].push_back(i);
  }
  int pages = 0;
  for (std::size_t page = 0; page < wanted.size(); ++page) {
    if (wanted[page].empty()) continue;
    PagePacker packer(settings_, settings_.pageCells, settings_.pageCells);
    for (const std::uint32_t i : wanted[page]) {
      const std::optional<Place> place = placeOf(shapes_[i], *sources[i].keep, settings_);
      if (!place || !packer.placeAt(shapes_[i], *place)) continue;
      places_[i] = *place;
      pageOf_[i] = static_cast<int>(page);
      isKept_[i] = true;
      pages = static_cast<int>(page) + 1;
    }
  }
  return pages;
}

/// The page with what lies on it already.
PagePacker AtlasPacker::openPage(int page) const {
  PagePacker packer(settings_, settings_.pageCells, settings_.pageCells);
  for (std::size_t i = 0; i < shapes_.size(); ++i)
    if (pageOf_[i] == page) packer.placeAt(shapes_[i], places_[i]);
  return packer;
}

std::vector<Group> AtlasPacker::makeGroups(std::span<const PackShape> sources) const {
  std::unordered_map<std::uint32_t, std::size_t> indexOf;  // looked up only
  std::vector<Group> groups;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i) {
    if (shapes_[i].texels.empty()) continue;
    const auto [entry, isNew] = indexOf.try_emplace(sources[i].group, groups.size());
    if (isNew) groups.push_back({sources[i].group, {}, 0, false, {}});
    Group& group = groups[entry->second];
    if (isKept_[i]) {
      group.opened = true;
      if (group.keptOn.empty() || group.keptOn.back() != pageOf_[i]) group.keptOn.push_back(pageOf_[i]);
      continue;
    }
    group.shapes.push_back(i);
    group.room += shapes_[i].room;
  }
  std::erase_if(groups, [](const Group& group) { return group.shapes.empty(); });
  for (Group& group : groups) sortBySize(shapes_, options_.pageSize, group.shapes);
  std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.room > b.room; });
  return groups;
}

/// Whole groups for the next page: those already begun first, then the largest that its room still holds; where even
/// one group is too much for a page, that group.
std::vector<std::uint32_t> AtlasPacker::selectForPage(const std::vector<Group>& groups,
                                                      std::vector<bool>& selected) const {
  const std::size_t page =
      static_cast<std::size_t>(settings_.pageCells) * static_cast<std::size_t>(settings_.pageCells);
  std::size_t sum = 0;
  std::vector<std::uint32_t> shapes;
  const auto take = [&](std::size_t g) {
    shapes.insert(shapes.end(), groups[g].shapes.begin(), groups[g].shapes.end());
    sum += groups[g].room;
    selected[g] = true;
  };
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (groups[g].opened) take(g);
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (!selected[g] && (sum == 0 || sum + groups[g].room <= page)) take(g);
  sortBySize(shapes_, options_.pageSize, shapes);
  return shapes;
}

void AtlasPacker::placeInto(PagePacker& packer, const std::vector<std::uint32_t>& shapes, Filling& filling) const {
  for (const std::uint32_t i : shapes) {
    if (progress_.cancelled()) return;
    if (const auto place = packer.place(shapes_[i])) filling.placed.emplace_back(i, *place);
  }
  filling.coverage = packer.coverage();
}

Filling AtlasPacker::fillByGroups(const std::vector<Group>& groups) const {
  PagePacker packer(settings_, settings_.pageCells, settings_.pageCells);
  Filling filling;
  std::vector<bool> selected(groups.size(), false);
  placeInto(packer, selectForPage(groups, selected), filling);
  for (std::size_t g = 0; g < groups.size() && filling.coverage < kCoverageGoal; ++g)
    if (!selected[g]) placeInto(packer, groups[g].shapes, filling);
  return filling;
}

Filling AtlasPacker::fillBySize(const std::vector<Group>& groups) const {
  PagePacker packer(settings_, settings_.pageCells, settings_.pageCells);
  std::vector<std::uint32_t> shapes;
  for (const Group& group : groups) shapes.insert(shapes.end(), group.shapes.begin(), group.shapes.end());
  sortBySize(shapes_, options_.pageSize, shapes);
  Filling filling;
  placeInto(packer, shapes, filling);
  return filling;
}

/// The next page. Groups that do not share a page well are mixed.
void AtlasPacker::fillPage(std::vector<Group>& groups, int page) {
  std::size_t left = 0;
  for (const Group& group : groups) left += group.shapes.size();
  Filling filling = fillByGroups(groups);
  if (groups.size() > 1 && filling.placed.size() < left && filling.coverage < kCoverageGoal) {
    Filling mixed = fillBySize(groups);
    if (mixed.coverage > filling.coverage) filling = std::move(mixed);
  }
  commit(filling, page, groups);
  pages_.push_back({settings_.pageCells, settings_.pageCells});
}

/// Places what a page was found to take, and strikes it from the groups.
void AtlasPacker::commit(const Filling& filling, int page, std::vector<Group>& groups) {
  for (const auto& [shape, place] : filling.placed) {
    places_[shape] = place;
    pageOf_[shape] = page;
  }
  progress_.advance(filling.placed.size());
  for (Group& group : groups) {
    const std::size_t before = group.shapes.size();
    std::erase_if(group.shapes, [&](std::uint32_t i) { return pageOf_[i] >= 0; });
    group.opened = group.opened || group.shapes.size() < before;
    group.room = roomOf(group.shapes);
  }
  std::erase_if(groups, [](const Group& group) { return group.shapes.empty(); });
}

/// What is new or changed, into the room that kept shapes leave: on the pages of its group first, then on any; a new
/// group only as a whole.
void AtlasPacker::fillKeptPages(std::vector<Group>& groups) {
  for (const bool atHome : {true, false})
    for (int page = 0; page < static_cast<int>(pages_.size()) && !groups.empty(); ++page) {
      PagePacker packer = openPage(page);
      Filling filling;
      for (const Group& group : groups) {
        const bool isHome = std::find(group.keptOn.begin(), group.keptOn.end(), page) != group.keptOn.end();
        if (atHome && !isHome) continue;
        if (group.opened) {
          placeInto(packer, group.shapes, filling);
        } else if (group.room <= packer.freeCells()) {
          PagePacker trial = packer;
          Filling whole;
          placeInto(trial, group.shapes, whole);
          if (whole.placed.size() < group.shapes.size()) continue;
          packer = std::move(trial);
          filling.placed.insert(filling.placed.end(), whole.placed.begin(), whole.placed.end());
        }
      }
      commit(filling, page, groups);
    }
}

/// All shapes on one page, or none.
bool AtlasPacker::packAll(const std::vector<std::uint32_t>& chosen, int width, int height, int page) {
  const auto places = packOnPage(shapes_, chosen, settings_, width, height, progress_);
  if (!places) return false;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    places_[chosen[k]] = (*places)[k];
    pageOf_[chosen[k]] = page;
  }
  return true;
}

/// Power-of-two sides, the smallest page first (of equals the squarer), up to the full page.
std::vector<std::array<int, 2>> AtlasPacker::pageSizes() const {
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
  return sizes;
}

void AtlasPacker::shrinkLastPage() {
  const int page = static_cast<int>(pages_.size()) - 1;
  std::vector<std::uint32_t> onPage;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i)
    if (pageOf_[i] == page) onPage.push_back(i);
  if (std::any_of(onPage.begin(), onPage.end(), [this](std::uint32_t i) { return isKept_[i]; })) return cutLastPage();
  std::vector<std::array<int, 2>> sizes = pageSizes();
  sizes.pop_back();  // the full page, which is known to do
  for (const auto& size : sizes)
    if (packAll(onPage, size[0], size[1], page)) {
      pages_.back() = size;
      return;
    }
}

/// The smallest page that holds its shapes where they are.
void AtlasPacker::cutLastPage() {
  const int page = static_cast<int>(pages_.size()) - 1;
  std::array<int, 2> needed = {0, 0};
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    if (pageOf_[i] != page) continue;
    const Place& place = places_[i];
    const SearchMask& mask = shapes_[i].orientations[static_cast<std::size_t>(place.orientation)].mask;
    needed[0] = std::max(needed[0], place.cell.x + mask.width + settings_.border);
    needed[1] = std::max(needed[1], place.cell.y + mask.height + settings_.border);
  }
  for (const auto& size : pageSizes())
    if (size[0] >= needed[0] && size[1] >= needed[1]) {
      pages_.back() = size;
      return;
    }
}

Expected<PackResult> AtlasPacker::run(std::span<const PackShape> sources) {
  const int keptPages = keepPlaces(sources);
  std::vector<Group> groups = makeGroups(sources);
  pages_.assign(static_cast<std::size_t>(keptPages), {settings_.pageCells, settings_.pageCells});
  fillKeptPages(groups);
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
      result.placements[i] = {0, 0, Vec2(shapes_[i].toBitmap + Vec2d(settings_.border + settings_.margin))};
    else if (pageOf_[i] >= 0)
      result.placements[i] = placementOf(shapes_[i], places_[i], pageOf_[i], settings_);
    result.placements[i].kept = isKept_[i];
  }
  for (const auto& page : pages_) {
    const auto texels = [&](int cells) {
      return cells == settings_.pageCells ? options_.pageSize : cells * settings_.block;
    };
    result.pages.push_back({texels(page[0]), texels(page[1])});
  }
  return result;
}

Expected<void> checkSizes(const std::vector<GridShape>& shapes, std::span<const PackShape> sources,
                          const GridSettings& settings) {
  const int limit = settings.pageCells * settings.block - 2 * (settings.border + settings.margin);
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
  const GridSettings settings = gridSettings(options.pageSize, options.padding, options.blockAlign);
  std::vector<GridShape> prepared = rasteriseShapes(shapes);
  if (const auto fits = checkSizes(prepared, shapes, settings); !fits) return fits.error();
  addOrientations(shapes, settings, prepared);
  progress.begin("packing", shapes.size());
  AtlasPacker packer(std::move(prepared), settings, options, progress);
  Expected<PackResult> result = packer.run(shapes);
  progress.end();
  return result;
}

}  // namespace lumel
