#include "baker/gather/gather_guide.h"

#include <cmath>
#include <cstddef>

namespace lumel {
namespace {

/// Share of the rays that all directions get alike: what a few rays tell of a bin may be wrong.
constexpr double kEven = 0.1;
/// Every bin is judged as if so many more rays had differed by as much as rays do on average.
constexpr double kPrior = 0.25;
/// Shares are interpolated between the middles of bins, in steps of a kFine-th of a bin.
constexpr std::size_t kFine = 4;

using Rows = std::array<double, kGuideRows>;
using Columns = std::array<double, kGuideColumns>;

/// `circular`: the first bin comes after the last; else values stay level beyond the middles of the outer bins.
template <std::size_t Bins>
std::array<double, kFine * Bins> interpolated(const std::array<double, Bins>& bins, bool circular) {
  std::array<double, kFine * Bins> fine;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const std::size_t bin = i / kFine;
    const double from = (static_cast<double>(i % kFine) + 0.5) / kFine - 0.5;  // the middle of the bin, in bins
    const std::size_t before = bin > 0 ? bin - 1 : (circular ? Bins - 1 : 0);
    const std::size_t after = bin + 1 < Bins ? bin + 1 : (circular ? 0 : Bins - 1);
    fine[i] = bins[bin] + std::abs(from) * (bins[from < 0.0 ? before : after] - bins[bin]);
  }
  return fine;
}

/// Ends of all but the last of `Pieces` parts of [0, 1] that hold equal shares of a density, which is positive and
/// given by equal steps.
template <std::size_t Pieces, std::size_t Steps>
std::array<std::uint16_t, Pieces - 1> equalParts(const std::array<double, Steps>& density) {
  double whole = 0.0;
  for (const double d : density) whole += d;
  std::array<std::uint16_t, Pieces - 1> knots;
  std::size_t step = 0;
  double before = 0.0;  // the steps before `step`
  std::uint32_t last = 0;
  for (std::size_t k = 1; k < Pieces; ++k) {
    const double wanted = whole * static_cast<double>(k) / Pieces;
    while (step + 1 < Steps && before + density[step] < wanted) before += density[step++];
    const double at = (static_cast<double>(step) + (wanted - before) / density[step]) / Steps;
    const auto knot = static_cast<std::uint32_t>(std::lround(at * Guide::kOne));
    // Every part keeps a width.
    last = std::clamp(knot, last + 1, Guide::kOne - static_cast<std::uint32_t>(Pieces - k));
    knots[k - 1] = static_cast<std::uint16_t>(last);
  }
  return knots;
}

double knotOf(std::uint16_t knot) { return static_cast<double>(knot) / Guide::kOne; }

template <std::size_t Inner>
double endOf(const std::array<std::uint16_t, Inner>& knots, std::size_t part) {
  return part < Inner ? knotOf(knots[part]) : 1.0;
}
template <std::size_t Inner>
double startOf(const std::array<std::uint16_t, Inner>& knots, std::size_t part) {
  return part > 0 ? knotOf(knots[part - 1]) : 0.0;
}

/// Points that have `shares` by bins, whose mean is 1.
Guide guideBy(const std::array<Columns, kGuideRows>& shares) {
  constexpr std::size_t kSteps = kFine * kGuideRows;
  std::array<Columns, kSteps> lines{};  // a line of columns for every fine step of rows
  std::array<double, kSteps> sums{};
  for (std::size_t c = 0; c < kGuideColumns; ++c) {
    Rows column;
    for (std::size_t r = 0; r < kGuideRows; ++r) column[r] = shares[r][c];
    const auto fine = interpolated(column, false);
    for (std::size_t i = 0; i < kSteps; ++i) {
      lines[i][c] = fine[i];
      sums[i] += fine[i];
    }
  }
  Guide guide;
  guide.rows = equalParts<kGuideRows>(sums);
  for (std::size_t r = 0; r < kGuideRows; ++r) {
    const double first = startOf(guide.rows, r) * kSteps, end = endOf(guide.rows, r) * kSteps;
    Columns sum{};
    for (auto i = static_cast<std::size_t>(first); i < kSteps && static_cast<double>(i) < end; ++i) {
      const double inside = std::min(end, static_cast<double>(i) + 1.0) - std::max(first, static_cast<double>(i));
      for (std::size_t c = 0; c < kGuideColumns; ++c) sum[c] += inside * lines[i][c];
    }
    guide.columns[r] = equalParts<kGuideColumns>(interpolated(sum, true));
  }
  return guide;
}

}  // namespace

void GuideTally::add(std::uint32_t bin, float luminance) {
  rays[bin] += 1.0f;
  light[bin] += luminance;
  squares[bin] += luminance * luminance;
}

void GuideTally::add(const GuideTally& other) {
  for (std::size_t b = 0; b < kGuideBins; ++b) {
    rays[b] += other.rays[b];
    light[b] += other.light[b];
    squares[b] += other.squares[b];
  }
}

Guide::Guide() {
  for (auto& row : columns)
    for (std::uint32_t c = 0; c < row.size(); ++c) row[c] = static_cast<std::uint16_t>(kOne / kGuideColumns * (c + 1));
}

GuideTable::GuideTable(const Guide& guide) {
  for (std::size_t r = 0; r < kGuideRows; ++r) {
    const double start = startOf(guide.rows, r), height = endOf(guide.rows, r) - start;
    dx[r] = static_cast<float>(height * kGuideRows);
    x0[r] = static_cast<float>(start - height * static_cast<double>(r));
    for (std::size_t c = 0; c < kGuideColumns; ++c) {
      const double left = startOf(guide.columns[r], c), width = endOf(guide.columns[r], c) - left;
      dy[r][c] = static_cast<float>(width * kGuideColumns);
      y0[r][c] = static_cast<float>(left - width * static_cast<double>(c));
    }
  }
}

GuideMaker::GuideMaker(const RnmKernels& kernels) {
  constexpr int kPoints = 8;  // across a bin
  for (std::size_t b = 0; b < kGuideBins; ++b) {
    std::array<double, 4> sum{}, squares{};
    for (int i = 0; i < kPoints * kPoints; ++i) {
      const Vec2 at((static_cast<float>(i / kPoints) + 0.5f) / kPoints, (static_cast<float>(i % kPoints) + 0.5f) / kPoints);
      const Vec2 bin(b / kGuideColumns, b % kGuideColumns);
      const Vec3 w = sampleGatherHemisphere((bin + at) / Vec2(kGuideRows, kGuideColumns));
      const Vec3 rnm = kernels(w);
      const std::array<float, 4> maps = {w.z, rnm.x, rnm.y, rnm.z};
      for (std::size_t m = 0; m < 4; ++m) {
        const auto counts = static_cast<double>(maps[m] / gatherHemispherePdf(w.z));
        sum[m] += counts / (kPoints * kPoints);
        squares[m] += counts * counts / (kPoints * kPoints);
      }
    }
    for (std::size_t m = 0; m < 4; ++m) {
      meanSquare_[b] += squares[m];
      variance_[b] += std::max(0.0, squares[m] - sum[m] * sum[m]);
    }
  }
}

Guide GuideMaker::make(const GuideTally& tally) const {
  // What a ray brings to a map is light times what it counts for. Both differ within a bin, and for the product's
  // variance they are taken as independent.
  std::array<double, kGuideBins> spread;
  double whole = 0.0, rays = 0.0;
  for (std::size_t b = 0; b < kGuideBins; ++b) {
    const auto count = static_cast<double>(tally.rays[b]), sum = static_cast<double>(tally.light[b]);
    const double ofMean = count > 0.0 ? sum * sum / count : 0.0;
    const double apart = std::max(0.0, static_cast<double>(tally.squares[b]) - ofMean);
    spread[b] = meanSquare_[b] * apart + variance_[b] * ofMean;
    whole += spread[b];
    rays += count;
  }
  if (!(whole > 0.0) || !std::isfinite(whole)) return {};
  const double usual = kPrior * whole / rays;
  std::array<Columns, kGuideRows> shares;
  double total = 0.0;
  for (std::size_t b = 0; b < kGuideBins; ++b) {
    const double freedom = std::max(0.0, static_cast<double>(tally.rays[b]) - 1.0);
    double& share = shares[b / kGuideColumns][b % kGuideColumns];
    share = std::sqrt((spread[b] + usual) / (freedom + kPrior));
    total += share;
  }
  for (Columns& row : shares)
    for (double& share : row) share = kEven + (1.0 - kEven) * share * kGuideBins / total;
  return guideBy(shares);
}

}  // namespace lumel
