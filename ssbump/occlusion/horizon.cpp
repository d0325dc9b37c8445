#include "ssbump/occlusion/horizon.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "scene/base/check.h"
#include "scene/base/parallel.h"
#include "ssbump/occlusion/horizon_slice.h"

namespace lumel::ssbump {
namespace {

// A block of texels goes through all azimuths before the next: what it reads stays in the L2 cache. Blocks lie at
// multiples of their size in the map, so that cells do.
constexpr int kBlockWidth = 2 * kHorizonBlock, kBlockHeight = 32;

constexpr std::size_t kAzimuthsAtOnce = 2;

int roundUp(int value, int step) { return (value + step - 1) / step * step; }
int roundDown(int value, int step) { return value / step * step; }

/// One octave's heights of cells and windows along both axes.
struct OctaveLevels {
  OctaveLevels(const RowMaxima& rows, const TexelRect& tile, const Octave& octave)
      : grid(octave.grid),
        along{FarLevel(rows, tile, grid, Along::X, 2 * octave.begin + 2 * grid.length, kCellBlock),
              FarLevel(rows, tile, grid, Along::Y, 2 * octave.begin + 2 * grid.length, kCellBlock)} {
    if (grid.cell > 1) cells = std::make_unique<CellHeights>(rows.field(), tile, grid.cell, kCellBlock);
  }
  WindowGrid grid;
  FarLevel along[2];
  std::unique_ptr<CellHeights> cells;  // absent: cells are texels
};

/// What all blocks of a tile share.
struct Tile {
  const RowMaxima& rows;
  TexelRect rect, blocks;  // blocks: the rectangle of whole blocks around it
  NearHeights heights;
  std::vector<OctaveLevels> octaves;  // outwards
  std::vector<Slice> slices;
};

/// The cells of one octave in a block, on one azimuth: what they ask for and what they are told.
struct Stage {
  Stage(const OctaveLevels& levels, int x, int y) : octave(levels) {
    const int cell = octave.grid.cell;
    cells.rows = kBlockHeight / cell;
    cells.columns = std::max(kCellBlock, kBlockWidth / cell);
    if (!octave.cells) return;  // texels: the kernel has their heights and keeps their slopes
    cells.lowest = octave.cells->lowest(x, y);
    cells.highest = octave.cells->highest(x, y);
    cells.heightStride = octave.cells->rowStride();
    slopes.resize(static_cast<std::size_t>(cells.rows * cells.columns + kCellBlock));
    changes.resize(slopes.size());
    cells.slopes = slopes.data();
    cells.changes = changes.data();
  }

  /// The block at (x, y) is to look along a slice.
  void aim(Along along, std::span<const FarStep> steps, int x, int y) {
    const FarLevel& level = octave.along[along == Along::X ? 0 : 1];
    windows.clear();
    inverses.clear();
    for (const FarStep& step : steps) {
      windows.push_back(level.at(x + step.x, y + step.y));
      inverses.push_back(step.inverseDistance);
    }
    cells.windows = windows;
    cells.windowStride = level.cellRowStride();
    cells.inverseDistances = inverses;
  }

  const OctaveLevels& octave;
  FarCells cells;
  std::vector<float> slopes, changes, inverses;
  std::vector<const float*> windows;
};

/// One block of texels on its way through the azimuths, a few at a time: their far horizons on cells, from the farthest
/// in, then their own near ones.
class Block {
 public:
  Block(const Tile& tile, int x, int y, std::size_t lobeCount)
      : tile_(tile), x_(x), y_(y), lobes_(lobeCount), stages_(kAzimuthsAtOnce), near_(kAzimuthsAtOnce) {
    const TexelRect& rect = tile.rect;
    firstRow_ = std::max(y, rect.y) - y;
    firstColumn_ = std::max(0, roundDown(rect.x - x, kHorizonBlock));
    const int rowCount = std::min(y + kBlockHeight, rect.y + rect.height) - y - firstRow_;
    const int columnCount = std::min(kBlockWidth, roundUp(rect.x + rect.width - x, kHorizonBlock)) - firstColumn_;
    const auto width = static_cast<std::size_t>(columnCount), rows = static_cast<std::size_t>(rowCount);
    sums_.resize(rows * lobes_ * width);
    for (std::size_t i = 0; i < rows * lobes_; ++i) sumRows_.push_back(&sums_[i * width]);
    for (int r = 0; r < rowCount; ++r)
      rows_.push_back({tile.heights.at(x + firstColumn_, y + firstRow_ + r),
                       tile.rows.field().highest - tile.rows.field().lowest,
                       {},
                       &sumRows_[static_cast<std::size_t>(r) * lobes_],
                       firstRow_ + r,
                       firstColumn_,
                       columnCount});
    for (std::vector<Stage>& stages : stages_) {
      stages.reserve(tile.octaves.size());
      for (const OctaveLevels& octave : tile.octaves) stages.emplace_back(octave, x, y);
      for (std::size_t o = 0; o + 1 < stages.size(); ++o) {
        stages[o].cells.farther = &stages[o + 1].cells;
        stages[o].cells.fartherIsTwice = stages[o + 1].octave.grid.cell > stages[o].octave.grid.cell;
      }
    }
  }

  void run(SimdLevel simd) {
    const std::span<const Slice> all = tile_.slices;
    for (std::size_t first = 0; first < all.size(); first += kAzimuthsAtOnce) {
      const auto some = all.subspan(first, std::min(kAzimuthsAtOnce, all.size() - first));
      for (std::size_t s = 0; s < some.size(); ++s) {
        std::vector<Stage>& stages = stages_[s];
        for (std::size_t o = stages.size(); o-- > 0;) {
          stages[o].aim(some[s].along, some[s].far[o], x_, y_);
          if (o > 0) farCells(stages[o].cells, simd);
        }
        near_[s] = {stages.empty() ? FarCells{} : stages[0].cells, some[s].near, some[s].lobes};
      }
      for (NearRow& row : rows_) row.slices = {near_.data(), some.size()};
      nearRows(rows_, simd);
    }
  }

  /// Returns the sum of a texel of the map.
  float sum(int x, int y, std::size_t lobe) const {
    return sumRows_[static_cast<std::size_t>(y - y_ - firstRow_) * lobes_ + lobe][x - x_ - firstColumn_];
  }

 private:
  const Tile& tile_;
  int x_, y_;                   // of the block
  int firstRow_, firstColumn_;  // of what is wanted of it, columns in whole kernel blocks
  std::size_t lobes_;
  std::vector<float> sums_;
  std::vector<float*> sumRows_;  // [row * lobes + lobe]
  std::vector<NearRow> rows_;
  std::vector<std::vector<Stage>> stages_;  // [azimuth][octave]; the first octave's cells are texels
  std::vector<NearSlice> near_;             // per azimuth
};

}  // namespace

int automaticReach(const HeightField& field) {
  const double span = static_cast<double>(field.highest) - static_cast<double>(field.lowest);
  const double side = std::max(field.width, field.height);
  const double most = field.wrap ? 4 * side : std::hypot(field.width, field.height);
  return static_cast<int>(std::ceil(std::clamp(span / 0.01, 1.0, std::max(1.0, most))));
}

int automaticAzimuths(const HeightField& field) {
  constexpr float kLowRelief = 32.0f;
  return field.highest - field.lowest <= kLowRelief ? 48 : 64;
}

Horizon::Horizon(const HeightField& field, const HorizonSettings& settings) : settings_(settings), rows_(field) {
  LUMEL_CHECK(settings.azimuths >= 0);
  if (settings_.azimuths == 0) settings_.azimuths = automaticAzimuths(field);
  if (settings_.reach <= 0) settings_.reach = automaticReach(field);
}

Image Horizon::occlusion(const TexelRect& rect, std::span<const Lobe> lobes, Progress& progress) const {
  TexelRect blocks{roundDown(rect.x, kBlockWidth), roundDown(rect.y, kBlockHeight), 0, 0};
  blocks.width = roundUp(rect.x + rect.width, kBlockWidth) - blocks.x;
  blocks.height = roundUp(rect.y + rect.height, kBlockHeight) - blocks.y;
  Tile tile{rows_, rect, blocks, NearHeights(rows_, blocks, nearReach() + 1), {}, {}};
  const std::vector<Octave> octaves = octavesTo(settings_.reach, kBlockHeight);
  for (const Octave& octave : octaves) tile.octaves.emplace_back(rows_, blocks, octave);
  for (int j = 0; j < settings_.azimuths; ++j)
    tile.slices.push_back(
        makeSlice(sliceAzimuth(j, settings_.azimuths), settings_.reach, octaves, lobes, tile.heights.rowStride()));
  // One axis after the other: each has levels of its own, which the L2 cache does not hold together.
  std::stable_sort(tile.slices.begin(), tile.slices.end(),
                   [](const Slice& a, const Slice& b) { return a.along < b.along; });
  std::vector<float> open(lobes.size(), 0.0f);  // summed as the kernel sums: flat gives exactly 1
  for (const Slice& slice : tile.slices)
    for (std::size_t c = 0; c < lobes.size(); ++c) open[c] += slice.lobes[c].open;
  Image out(rect.width, rect.height, static_cast<int>(lobes.size()));
  const int across = blocks.width / kBlockWidth, down = blocks.height / kBlockHeight;
  parallelFor(static_cast<std::size_t>(across * down), 1, [&](std::size_t first, std::size_t) {
    if (progress.cancelled()) return;
    const int x0 = blocks.x + static_cast<int>(first) % across * kBlockWidth,
              y0 = blocks.y + static_cast<int>(first) / across * kBlockHeight;
    Block block(tile, x0, y0, lobes.size());
    block.run(settings_.simd);
    const int left = std::max(x0, rect.x), right = std::min(x0 + kBlockWidth, rect.x + rect.width);
    const int top = std::max(y0, rect.y), bottom = std::min(y0 + kBlockHeight, rect.y + rect.height);
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x)
        for (std::size_t c = 0; c < lobes.size(); ++c)
          out.at(x - rect.x, y - rect.y)[c] = open[c] > 0 ? std::clamp(block.sum(x, y, c) / open[c], 0.0f, 1.0f) : 1.0f;
    progress.advance(static_cast<std::uint64_t>(right - left) * static_cast<std::uint64_t>(bottom - top));
  });
  return out;
}

}  // namespace lumel::ssbump
