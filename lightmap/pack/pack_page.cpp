#include "lightmap/pack/pack_page.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Variants tried where the plain order fails: about this many placements in all, within these bounds.
constexpr std::size_t kPlacementBudget = 20000;
constexpr std::size_t kFewestVariants = 4;
constexpr std::size_t kMostVariants = 128;

/// Fuller pages than this are beyond any order.
constexpr double kHopeless = 0.985;

/// Variants move a shape with at least this share of all room in the order and give it an aspect; smaller ones fill the
/// gaps in any order.
constexpr double kReorderedShare = 0.002;

std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
  std::uint64_t h = a * 0x9e3779b97f4a7c15u + b;
  h ^= h >> 30;
  h *= 0xbf58476d1ce4e5b9u;
  h ^= h >> 27;
  h *= 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

bool hasAspect(const SearchMask& mask, Aspect aspect) {
  return aspect == Aspect::Any || (aspect == Aspect::Wide ? mask.width >= mask.height : mask.height >= mask.width);
}

struct Step {
  std::uint32_t shape = 0;
  Aspect aspect = Aspect::Any;
};

/// The order and aspects of variant `variant`; 0 is the plain one. Shapes of equal size are treated alike, so that
/// they can form rows.
std::vector<Step> stepsOf(std::span<const GridShape> shapes, const std::vector<std::uint32_t>& bySize,
                          std::size_t totalRoom, std::size_t variant) {
  std::vector<Step> steps;
  steps.reserve(bySize.size());
  for (const std::uint32_t i : bySize) steps.push_back({i, Aspect::Any});
  if (variant == 0) return steps;
  std::vector<double> rank(shapes.size(), 0.0);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const GridShape& shape = shapes[steps[k].shape];
    rank[steps[k].shape] = -static_cast<double>(k);
    if (static_cast<double>(shape.room) < kReorderedShare * static_cast<double>(totalRoom)) continue;
    const double longer = std::max(shape.size.x, shape.size.y);
    const double shorter = std::min(shape.size.x, shape.size.y);
    const std::uint64_t size = static_cast<std::uint64_t>(longer) << 32 | static_cast<std::uint64_t>(shorter);
    const std::uint64_t random = mixed(variant, size);
    const double jitter = static_cast<double>(random >> 40) / (1 << 24);
    rank[steps[k].shape] = longer * (variant % 2 == 0 ? 0.6 + 0.8 * jitter : 1.0);
    steps[k].aspect = static_cast<Aspect>(random % 3);
  }
  std::stable_sort(steps.begin(), steps.end(),
                   [&](const Step& a, const Step& b) { return rank[a.shape] > rank[b.shape]; });
  return steps;
}

}  // namespace

std::optional<Place> PagePacker::findPlace(const GridShape& shape, Aspect aspect) {
  double bestScore = std::numeric_limits<double>::infinity();
  std::optional<Place> best;
  for (std::size_t i = 0; i < shape.orientations.size(); ++i) {
    const SearchMask& mask = shape.orientations[i].mask;
    if (!hasAspect(mask, aspect)) continue;
    // Contact all around is worth the shorter side: half a chart sunk into what is there.
    const double worth = std::min(mask.width, mask.height);
    const double reach = bestScore + worth - mask.height;
    const int lastRow = reach < grid_.height() ? static_cast<int>(std::ceil(reach)) - 1 : grid_.height();
    // Cells are never given back, so where this very mask did not fit before it does not fit now.
    int& firstRow = firstRow_[mask.hash];
    const auto fit = grid_.findLowest(mask, firstRow, lastRow);
    firstRow = std::max(firstRow, fit ? fit->cell.y : lastRow + 1);
    if (!fit) continue;
    const double score = fit->cell.y + mask.height - worth * fit->contact;
    if (score >= bestScore) continue;
    bestScore = score;
    best = {static_cast<int>(i), fit->cell};
  }
  return best;
}

std::optional<Place> PagePacker::place(const GridShape& shape, Aspect aspect) {
  std::optional<Place> place = findPlace(shape, aspect);
  if (!place && aspect != Aspect::Any) place = findPlace(shape, Aspect::Any);
  if (place) take(shape, *place);
  return place;
}

bool PagePacker::placeAt(const GridShape& shape, const Place& place) {
  if (!grid_.fits(shape.orientations[static_cast<std::size_t>(place.orientation)].mask, place.cell)) return false;
  take(shape, place);
  return true;
}

void PagePacker::take(const GridShape& shape, const Place& place) {
  const int turns = shape.orientations[static_cast<std::size_t>(place.orientation)].quarterTurns;
  const Taken taken = takenBy(shape, turns, settings_);
  grid_.insert(taken.cells, place.cell.x - taken.margin, place.cell.y - taken.margin);
  covered_ += shape.cells;
}

double PagePacker::coverage() const {
  return static_cast<double>(covered_) / (static_cast<double>(grid_.width()) * grid_.height());
}

void sortBySize(std::span<const GridShape> shapes, int pageSide, std::vector<std::uint32_t>& indices) {
  const auto key = [&](std::uint32_t i) {
    const GridShape& shape = shapes[i];
    const double longer = std::max(shape.size.x, shape.size.y);
    const double shorter = std::min(shape.size.x, shape.size.y);
    const double isLong = longer > 0.5 * pageSide ? 1 : 0;
    return std::array<double, 4>{isLong, shorter, longer, static_cast<double>(shape.cells)};
  };
  std::sort(indices.begin(), indices.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto keyA = key(a);
    const auto keyB = key(b);
    return keyA != keyB ? keyA > keyB : a < b;
  });
}

std::optional<std::vector<Place>> packOnPage(std::span<const GridShape> shapes, std::vector<std::uint32_t> chosen,
                                             const GridSettings& settings, int width, int height, Progress& progress) {
  const std::size_t cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::size_t room = 0;
  std::size_t masks = 0;
  for (const std::uint32_t i : chosen) {
    room += shapes[i].room;
    masks += shapes[i].cells;
  }
  if (room > cells) return std::nullopt;
  const std::vector<std::uint32_t> original = chosen;
  sortBySize(shapes, std::min(width, height) * settings.block, chosen);

  const auto attempt = [&](std::size_t variant,
                           const std::atomic<std::size_t>& firstFit) -> std::optional<std::vector<Place>> {
    std::vector<Place> places(shapes.size());
    PagePacker packer(settings, width, height);
    std::size_t left = masks;
    for (const Step& step : stepsOf(shapes, chosen, room, variant)) {
      if (progress.cancelled() || left > packer.freeCells() || firstFit.load() < variant) return std::nullopt;
      const auto place = packer.place(shapes[step.shape], step.aspect);
      if (!place) return std::nullopt;
      places[step.shape] = *place;
      left -= shapes[step.shape].cells;
    }
    return places;
  };

  std::atomic<std::size_t> firstFit{std::numeric_limits<std::size_t>::max()};
  std::optional<std::vector<Place>> found = attempt(0, firstFit);
  if (!found && static_cast<double>(room) <= kHopeless * static_cast<double>(cells)) {
    const std::size_t variants = std::clamp(kPlacementBudget / chosen.size(), kFewestVariants, kMostVariants);
    std::vector<std::optional<std::vector<Place>>> results(variants);
    parallelFor(variants, 1, [&](std::size_t first, std::size_t) {
      results[first] = attempt(first + 1, firstFit);
      std::size_t known = firstFit.load();
      while (results[first] && first + 1 < known && !firstFit.compare_exchange_weak(known, first + 1)) {
      }
    });
    for (auto& result : results)
      if (!found && result) found = std::move(result);
  }
  if (!found) return std::nullopt;
  std::vector<Place> places;
  places.reserve(original.size());
  for (const std::uint32_t i : original) places.push_back((*found)[i]);
  return places;
}

}  // namespace lumel
