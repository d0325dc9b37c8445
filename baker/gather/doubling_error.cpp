#include "baker/gather/doubling_error.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "baker/rays/lanes.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr int kTile = 4;  // side of the tiles that PageTexels are ordered by
/// Rates that are believed. Below 1 means fall more slowly than those of independent samples: what is seen of a cache
/// that itself still moves, and outliers that come late.
constexpr double kSlowest = 0.85;
constexpr double kFastest = 2.0;

}  // namespace

DoublingError::DoublingError(const std::vector<PageTexels>& pages, double credit) : credit_(credit) {
  for (const PageTexels& page : pages) addPage(page);
  squares_.resize(runs_.empty() ? 0 : runs_.back().first + runs_.back().count);
  sums_.resize(squares_.size());
}

/// A run belongs to the tile of its middle texel; runs in the tiles around it are its neighbours.
void DoublingError::addPage(const PageTexels& page) {
  const int tilesX = (page.width + kTile - 1) / kTile;
  const int tilesY = (page.height + kTile - 1) / kTile;
  std::vector<std::uint32_t> runOf(static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY), kNone);
  const std::size_t firstRun = runs_.size();
  std::size_t texel = runs_.empty() ? 0 : runs_.back().first + runs_.back().count;
  const auto tileOf = [&](std::size_t first, std::size_t count) {
    const TexelCoord at = page.coords[first + count / 2];
    return std::pair(static_cast<int>(at.x) / kTile, static_cast<int>(at.y) / kTile);
  };
  const auto indexOf = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(tilesX) + static_cast<std::size_t>(x);
  };
  for (std::size_t first = 0; first < page.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, page.size() - first);
    const auto [x, y] = tileOf(first, count);
    runOf[indexOf(x, y)] = static_cast<std::uint32_t>(runs_.size());
    runs_.push_back({.first = texel, .count = static_cast<std::uint32_t>(count)});
    texel += count;
  }
  around_.resize(runs_.size());
  for (std::size_t r = firstRun; r < runs_.size(); ++r) {
    const auto [tileX, tileY] = tileOf((r - firstRun) * kLanes, runs_[r].count);
    auto next = around_[r].begin();
    for (int y = tileY - 1; y <= tileY + 1; ++y)
      for (int x = tileX - 1; x <= tileX + 1; ++x)
        *next++ = x >= 0 && y >= 0 && x < tilesX && y < tilesY ? runOf[indexOf(x, y)] : kNone;
    around_[r][4] = static_cast<std::uint32_t>(r);
  }
}

void DoublingError::add(std::size_t index, std::span<const float> before, std::span<const float> now, std::uint32_t n0,
                        std::uint32_t n1, std::uint32_t leftOut) {
  Run& run = runs_[index];
  // now - before is d for equal halves; independent samples would have the same expectation with others by this.
  const double scale = std::sqrt(static_cast<double>(n0) / n1);
  double sum = 0.0;
  double sumBefore = 0.0;
  run.counting = 0;
  for (std::size_t i = 0; i < run.count; ++i) {
    if ((leftOut >> i) & 1u) {
      squares_[run.first + i] = sums_[run.first + i] = kLeftOut;
      continue;
    }
    ++run.counting;
    sumBefore += static_cast<double>(squares_[run.first + i]);
    const double d = (static_cast<double>(now[i]) - static_cast<double>(before[i])) * scale;
    squares_[run.first + i] = static_cast<float>(d * d);
    sum += d * d;
  }
  run.movedBefore = n0 == n1 && run.moved >= 0.0 ? sumBefore : -1.0;
  run.moved = n0 == 0 ? -1.0 : sum;
  run.samplesBefore = n0;
  run.samples = n0 + n1;
}

void DoublingError::endPass(const std::vector<std::uint8_t>& live) {
  double before = 0.0;
  double now = 0.0;
  for (std::size_t r = 0; r < runs_.size(); ++r)
    if (live[r] && runs_[r].movedBefore >= 0.0) {
      before += runs_[r].movedBefore;
      now += runs_[r].moved;
    }
  if (before > 0.0 && now > 0.0) rate_ = std::clamp(std::log2(before / now), kSlowest, kFastest);
  const double factor = std::pow(std::exp2(rate_) - 1.0, -credit_);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    Run& run = runs_[r];
    if (!live[r] || run.samplesBefore == 0) continue;
    const auto fall = static_cast<float>(std::pow(static_cast<double>(run.samplesBefore) / run.samples, rate_));
    double sum = 0.0;
    for (std::size_t t = run.first; t < run.first + run.count; ++t) {
      if (sums_[t] == kLeftOut) continue;
      sums_[t] = sums_[t] * fall + squares_[t];
      sum += static_cast<double>(sums_[t]);
    }
    ++run.doublings;
    run.factor = factor;
    run.meanSquare = sum / (std::max(1u, run.counting) * static_cast<double>(run.doublings));
  }
  parallelFor(runs_.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r)
      if (live[r] && runs_[r].doublings > 0) runs_[r].pool = poolAround(r);
  });
}

double DoublingError::poolAround(std::size_t index) const {
  const Run& run = runs_[index];
  double pooled = 0.0;
  double texels = 0.0;
  for (const std::uint32_t r : around_[index]) {
    if (r == kNone || runs_[r].doublings == 0) continue;
    const Run& near = runs_[r];
    // A run that was done earlier has fewer samples.
    const double fall =
        near.samples == run.samples ? 1.0 : std::pow(static_cast<double>(near.samples) / run.samples, rate_);
    pooled += near.meanSquare * near.counting * fall;
    texels += near.counting;
  }
  return texels > 0.0 ? pooled / texels : 0.0;
}

float DoublingError::standardError(std::size_t index, std::size_t i) const {
  const Run& run = runs_[index];
  if (run.doublings == 0) return 0.0f;
  const auto own = static_cast<double>(sums_[run.first + i]);
  const double joined = (own + kPrior * run.pool) / (run.doublings + kPrior);
  const double moved = own < 0.0 ? run.pool : std::max(own / run.doublings, joined);
  return static_cast<float>(std::sqrt(run.factor * moved));
}

}  // namespace lumel
