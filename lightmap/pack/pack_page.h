// One atlas page: placing shapes in turn, and packing a whole set on a page of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "lightmap/pack/pack_shape.h"
#include "scene/base/progress.h"

namespace lumel {

struct Place {
  int orientation = 0;  // into GridShape::orientations
  Cell cell;
};

/// Names the orientations of a shape that are tried first: those at least as wide as tall, or the others.
enum class Aspect { Any, Wide, Tall };

class PagePacker {
 public:
  PagePacker(const GridSettings& settings, int width, int height)
      : settings_(settings), grid_(width, height, settings.border) {}

  /// Puts the shape where its upper edge comes lowest, the lower for touching what is there, in an orientation of the
  /// aspect if it fits in one of them. Nothing: it fits nowhere.
  std::optional<Place> place(const GridShape& shape, Aspect aspect = Aspect::Any);

  /// Puts it there, if it fits.
  bool placeAt(const GridShape& shape, const Place& place);

  std::size_t freeCells() const { return grid_.freeCells(); }
  double coverage() const;

 private:
  void take(const GridShape& shape, const Place& place);
  std::optional<Place> findPlace(const GridShape& shape, Aspect aspect);

  GridSettings settings_;
  PackGrid grid_;
  std::unordered_map<std::uint64_t, int> firstRow_;  // by mask hash; looked up only, never walked
  std::size_t covered_ = 0;
};

/// Larger ones first: those longer than half of the page's side (texels), which find no place late, then by their
/// shorter side, so that strips fill what broad shapes leave.
void sortBySize(std::span<const GridShape> shapes, int pageSide, std::vector<std::uint32_t>& indices);

/// All of `chosen` on one page of width x height cells, or nothing. Where plain order of size does not do it, tries
/// other orders and aspects for the shapes that matter, the more the fewer shapes there are; the first variant of a
/// fixed sequence that fits wins, so the result does not depend on threads. Nothing also if cancelled.
std::optional<std::vector<Place>> packOnPage(std::span<const GridShape> shapes, std::vector<std::uint32_t> chosen,
                                             const GridSettings& settings, int width, int height, Progress& progress);

}  // namespace lumel
