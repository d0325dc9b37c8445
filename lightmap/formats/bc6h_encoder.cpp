// Encoding of BC6H blocks (bc6h.h). What is minimised is the squared error of linear values; end points and indices
// live in the numbers that blocks interpolate, which are half floats read as whole numbers, so that one step of them is
// about the same share of a value everywhere.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "lightmap/formats/bc6h.h"
#include "scene/base/half.h"

namespace lumel::bc6h {
namespace {

/// All 32 take four times as long and lower the error by 4% (courtyard), 5% (Cornell box) and 10% (Sponza).
constexpr std::size_t kPartitionsTried = 4;
constexpr int kRounds = 3;      // of end points and indices in turn
constexpr int kStepPasses = 3;  // over all end points, one step up and down each

/// Slopes count as at least this share of the block's largest value. A dark texel's own slope says nothing of what it
/// costs to take it for a bright one: without a floor the lines of blocks on the edge of a shadow left the shade alone.
constexpr float kLeastSlope = 1.0f / (1024 * 128);

using Color = std::array<float, 3>;

/// A value for each half.
const std::vector<float>& halfTable() {
  static const std::vector<float> table = [] {
    std::vector<float> values(0x10000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = floatFromHalf(static_cast<std::uint16_t>(i));
    return values;
  }();
  return table;
}

/// The block in the numbers that are interpolated.
struct Problem {
  bool isSigned = false;
  const float* halves = nullptr;
  std::array<Color, kTexels> linear{};
  std::array<Color, kTexels> place{};  // where the value lies among the interpolated numbers
  std::array<Color, kTexels> pull{};   // weight of a squared difference of these: the value's slope there, squared
  std::array<float, kTexels> weight{};
  Color channelScale{};  // root of the mean pull

  Problem(const Texels& texels, bool sign) : isSigned(sign), halves(halfTable().data()) {
    const float unit = isSigned ? 32.0f / 31.0f : 64.0f / 31.0f;
    float most = 0.0f;
    for (std::size_t i = 0; i < kTexels; ++i) {
      weight[i] = texels.weights[i];
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = texels.colors[i][static_cast<int>(c)];
        linear[i][c] = isSigned ? value : std::max(value, 0.0f);
        if (weight[i] > 0.0f) most = std::max(most, std::abs(linear[i][c]));
      }
    }
    const float leastSlope = kLeastSlope * most;
    Color sums{};
    for (std::size_t i = 0; i < kTexels; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const auto half = static_cast<std::uint16_t>(halfFromFloat(linear[i][c]) & 0x7fffu);
        const float below = halves[half];
        const float step = halves[std::min(half + 1, 0x7bff)] - halves[std::min<int>(half, 0x7bfe)];
        const float exact = static_cast<float>(half) + (std::abs(linear[i][c]) - below) / step;
        place[i][c] = std::copysign(exact * unit, linear[i][c]);
        const float slope = std::max(step, leastSlope) / unit;
        pull[i][c] = weight[i] * slope * slope;
        sums[c] += pull[i][c];
      }
    // Channels that are all but nothing still need an axis.
    const float widest = std::max({sums[0], sums[1], sums[2]});
    for (std::size_t c = 0; c < 3; ++c) channelScale[c] = std::sqrt(std::max(sums[c], 1e-9f * widest));
  }

  float valueOf(int interpolated) const { return halves[halfBits(interpolated, isSigned)]; }
  float least() const { return isSigned ? -32767.0f : 0.0f; }
  float most() const { return isSigned ? 32767.0f : 65535.0f; }
};

/// A set of texels as bits.
using TexelSet = std::uint16_t;

template <class Body>
void forEachTexel(TexelSet set, Body&& body) {
  for (unsigned rest = set; rest != 0; rest &= rest - 1) body(static_cast<std::size_t>(std::countr_zero(rest)));
}

/// The line through the colours of a set that leaves least beside it.
struct Axis {
  Color middle{};
  Color direction{};
  float along = 0.0f;   // sum of squares along it
  float beside = 0.0f;  // and across
};

Axis axisOf(const Problem& problem, TexelSet set) {
  Axis axis;
  float total = 0.0f;
  forEachTexel(set, [&](std::size_t i) {
    const float w = problem.weight[i];
    total += w;
    for (std::size_t c = 0; c < 3; ++c) axis.middle[c] += w * problem.place[i][c];
  });
  if (!(total > 0.0f)) return axis;
  for (float& m : axis.middle) m /= total;
  float square[3][3] = {};
  forEachTexel(set, [&](std::size_t i) {
    Color d;
    for (std::size_t c = 0; c < 3; ++c) d[c] = (problem.place[i][c] - axis.middle[c]) * problem.channelScale[c];
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = a; b < 3; ++b) square[a][b] += problem.weight[i] * d[a] * d[b];
  });
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < a; ++b) square[a][b] = square[b][a];
  const float trace = square[0][0] + square[1][1] + square[2][2];
  std::size_t widest = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if (square[c][c] > square[widest][widest]) widest = c;
  Color v = {square[widest][0], square[widest][1], square[widest][2]};
  for (int step = 0; step < 6; ++step) {  // power iteration
    const float length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 0.0f)) break;
    for (float& x : v) x /= length;
    axis.direction = v;
    for (std::size_t a = 0; a < 3; ++a)
      v[a] = square[a][0] * axis.direction[0] + square[a][1] * axis.direction[1] + square[a][2] * axis.direction[2];
  }
  axis.along = v[0] * axis.direction[0] + v[1] * axis.direction[1] + v[2] * axis.direction[2];
  axis.beside = std::max(0.0f, trace - axis.along);
  return axis;
}

/// A region of a block while it is encoded.
struct Region {
  TexelSet texels = 0;
  std::size_t anchor = 0;  // its texel whose index lies in the lower half
};

/// End points as real numbers, by channel.
struct Ends {
  std::array<std::array<float, 2>, 3> of{};
};

/// First indices: places of the projections between the outermost ones. The anchor's lies in the lower half.
void indicesAlong(const Problem& problem, const Region& region, const Axis& axis, std::span<const int> shares,
                  std::array<std::uint8_t, kTexels>& indices) {
  std::array<float, kTexels> at{};
  float least = std::numeric_limits<float>::max(), most = std::numeric_limits<float>::lowest();
  forEachTexel(region.texels, [&](std::size_t i) {
    for (std::size_t c = 0; c < 3; ++c)
      at[i] += (problem.place[i][c] - axis.middle[c]) * problem.channelScale[c] * axis.direction[c];
    if (problem.weight[i] > 0.0f) {
      least = std::min(least, at[i]);
      most = std::max(most, at[i]);
    }
  });
  const float width = most - least;
  const auto last = static_cast<float>(shares.size() - 1);
  const bool turned = width > 0.0f && at[region.anchor] - least > 0.5f * width;
  forEachTexel(region.texels, [&](std::size_t i) {
    float share = width > 0.0f ? (at[i] - least) / width : 0.0f;
    if (turned) share = 1.0f - share;
    indices[i] = static_cast<std::uint8_t>(std::lround(std::clamp(share, 0.0f, 1.0f) * last));
  });
  indices[region.anchor] = std::min(indices[region.anchor], static_cast<std::uint8_t>(shares.size() / 2 - 1));
}

/// The end points that serve these indices best: two unknowns and the texels' equations in each channel.
Ends leastSquares(const Problem& problem, const Region& region, std::span<const int> shares,
                  const std::array<std::uint8_t, kTexels>& indices) {
  Ends ends;
  for (std::size_t c = 0; c < 3; ++c) {
    double aa = 0, ab = 0, bb = 0, av = 0, bv = 0;
    forEachTexel(region.texels, [&](std::size_t i) {
      const double b = shares[indices[i]] / 64.0, a = 1.0 - b, w = static_cast<double>(problem.pull[i][c]);
      const double v = static_cast<double>(problem.place[i][c]);
      aa += w * a * a;
      ab += w * a * b;
      bb += w * b * b;
      av += w * a * v;
      bv += w * b * v;
    });
    const double det = aa * bb - ab * ab;
    const double sum = aa + 2 * ab + bb;
    double first = 0, second = 0;
    if (det > 1e-6 * sum * sum) {
      first = (bb * av - ab * bv) / det;
      second = (aa * bv - ab * av) / det;
    } else if (sum > 0) {
      first = second = (av + bv) / sum;
    }
    ends.of[c] = {std::clamp(static_cast<float>(first), problem.least(), problem.most()),
                  std::clamp(static_cast<float>(second), problem.least(), problem.most())};
  }
  return ends;
}

/// The value of a mode's precision whose interpolated number is nearest.
int quantized(float place, int precision, bool isSigned) {
  if (isSigned) {
    if (precision >= 16) return static_cast<int>(std::lround(place));
    const int most = (1 << (precision - 1)) - 1;
    const float size = std::abs(place) * static_cast<float>(1 << (precision - 1)) / 32768.0f;
    const int value = std::clamp(static_cast<int>(std::lround(std::max(0.0f, size - 0.5f))), 0, most);
    return place < 0.0f ? -value : value;
  }
  if (precision >= 15) return static_cast<int>(std::lround(place));
  const float value = place * static_cast<float>(1 << precision) / 65536.0f - 0.5f;
  return std::clamp(static_cast<int>(std::lround(value)), 0, (1 << precision) - 1);
}

/// What the squared sum of a block's differences counts beside the sum of their squares. Blocks on the edge of a shadow
/// are off to one side by choice otherwise, and the page's mean with them.
constexpr double kMeanWeight = 0.2;

/// A block under construction with the error that it makes.
struct Candidate {
  Parts parts;
  std::array<double, 2> errors{};               // squared, by region
  std::array<std::array<double, 3>, 2> sums{};  // of differences by region and channel
  double error() const {
    double total = errors[0] + errors[1];
    for (std::size_t c = 0; c < 3; ++c) total += kMeanWeight * (sums[0][c] + sums[1][c]) * (sums[0][c] + sums[1][c]);
    return total;
  }
};

class Encoder {
 public:
  Encoder(const Texels& texels, bool isSigned) : problem_(texels, isSigned) {}

  Block run() {
    best_.errors = {std::numeric_limits<double>::max(), 0.0};
    const Region whole{0xffff, 0};
    const Axis axis = axisOf(problem_, whole.texels);
    for (std::size_t m = kModes; m-- > 0 && mode(m).regions == 1;) tryMode(m, 0, {whole, Region{}}, {axis, Axis{}});
    if (axis.along + axis.beside > 0.0f) tryPartitions(axis);
    improveStepByStep();
    return pack(best_.parts);
  }

 private:
  /// Partitions by what two lines leave beside them and what eight indices along them cannot tell apart.
  void tryPartitions(const Axis& whole) {
    struct Ranked {
      float score;
      std::size_t partition;
      std::array<Axis, 2> axes;
    };
    std::array<Ranked, kPartitions> ranked;
    for (std::size_t p = 0; p < kPartitions; ++p) {
      const TexelSet second = partition(p);
      ranked[p] = {0.0f, p, {axisOf(problem_, static_cast<TexelSet>(~second)), axisOf(problem_, second)}};
      for (const Axis& axis : ranked[p].axes) ranked[p].score += axis.beside + axis.along / 49.0f;
    }
    std::partial_sort(ranked.begin(), ranked.begin() + kPartitionsTried, ranked.end(),
                      [](const Ranked& a, const Ranked& b) {
                        return std::tie(a.score, a.partition) < std::tie(b.score, b.partition);
                      });
    for (std::size_t k = 0; k < kPartitionsTried; ++k) {
      const Ranked& r = ranked[k];
      if (r.score > 2.0f * (whole.beside + whole.along / 225.0f)) break;
      const TexelSet second = partition(r.partition);
      const std::array<Region, 2> regions = {Region{static_cast<TexelSet>(~second), 0},
                                             Region{second, static_cast<std::size_t>(anchor(r.partition))}};
      for (std::size_t m = 0; m < kModes && mode(m).regions == 2; ++m) tryMode(m, r.partition, regions, r.axes);
    }
  }

  void tryMode(std::size_t index, std::size_t partitionIndex, const std::array<Region, 2>& regions,
               const std::array<Axis, 2>& axes) {
    const Mode& m = mode(index);
    const auto count = static_cast<std::size_t>(m.regions);
    const std::span<const int> shares = weights(m.regions);
    Candidate candidate;
    candidate.parts.mode = index;
    candidate.parts.partition = partitionIndex;
    for (std::size_t r = 0; r < count; ++r)
      indicesAlong(problem_, regions[r], axes[r], shares, candidate.parts.indices);
    for (int round = 0; round < kRounds; ++round) {
      std::array<Ends, 2> ends;
      for (std::size_t r = 0; r < count; ++r)
        ends[r] = leastSquares(problem_, regions[r], shares, candidate.parts.indices);
      quantize(m, ends, candidate.parts);
      for (std::size_t r = 0; r < count; ++r) chooseIndices(candidate, r, regions[r]);
      const bool isBetter = candidate.error() < best_.error();
      if (isBetter) {
        best_ = candidate;
        regions_ = regions;
      } else if (round > 0 || candidate.error() > 4.0 * best_.error()) {
        return;
      }
    }
  }

  /// End points in the mode's precision, moved to where the mode's differences reach.
  void quantize(const Mode& m, const std::array<Ends, 2>& ends, Parts& parts) const {
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<int, 4>& q = parts.ends[c];
      for (std::size_t point = 0; point < 2 * static_cast<std::size_t>(m.regions); ++point)
        q[point] = quantized(ends[point / 2].of[c][point % 2], m.precision, problem_.isSigned);
      if (!m.areDeltas) continue;
      const int reach = 1 << (m.deltaBits[c] - 1);
      for (std::size_t point = 1; point < 2 * static_cast<std::size_t>(m.regions); ++point)
        q[point] = std::clamp(q[point], q[0] - reach, q[0] + reach - 1);
    }
  }

  /// Takes the best index for each texel of a region.
  void chooseIndices(Candidate& candidate, std::size_t which, const Region& region) const {
    const Parts& parts = candidate.parts;
    const Mode& m = mode(parts.mode);
    const std::span<const int> shares = weights(m.regions);
    std::array<Color, 16> palette;
    for (std::size_t c = 0; c < 3; ++c) {
      const int a = unquantized(parts.ends[c][2 * which], m.precision, problem_.isSigned);
      const int b = unquantized(parts.ends[c][2 * which + 1], m.precision, problem_.isSigned);
      for (std::size_t k = 0; k < shares.size(); ++k)
        palette[k][c] = problem_.valueOf((a * (64 - shares[k]) + b * shares[k] + 32) >> 6);
    }
    double& total = candidate.errors[which] = 0.0;
    std::array<double, 3>& sums = candidate.sums[which] = {};
    forEachTexel(region.texels, [&](std::size_t i) {
      const std::size_t count = i == region.anchor ? shares.size() / 2 : shares.size();
      float least = std::numeric_limits<float>::max();
      std::size_t best = 0;
      for (std::size_t k = 0; k < count; ++k) {
        const float r = palette[k][0] - problem_.linear[i][0], g = palette[k][1] - problem_.linear[i][1],
                    b = palette[k][2] - problem_.linear[i][2];
        const float error = r * r + g * g + b * b;
        if (error < least) {
          least = error;
          best = k;
        }
      }
      candidate.parts.indices[i] = static_cast<std::uint8_t>(best);
      total += static_cast<double>(problem_.weight[i] * least);
      for (std::size_t c = 0; c < 3; ++c)
        sums[c] += static_cast<double>(problem_.weight[i] * (palette[best][c] - problem_.linear[i][c]));
    });
  }

  /// Moves each end point by one step where that helps, until nothing does.
  void improveStepByStep() {
    const Mode& m = mode(best_.parts.mode);
    for (int pass = 0; pass < kStepPasses; ++pass) {
      bool moved = false;
      for (std::size_t point = 0; point < 2 * static_cast<std::size_t>(m.regions); ++point)
        for (std::size_t c = 0; c < 3; ++c)
          for (const int step : {-1, 1}) moved = improveBy(m, point, c, step) || moved;
      if (!moved) break;
    }
  }

  bool improveBy(const Mode& m, std::size_t point, std::size_t c, int step) {
    Candidate moved = best_;
    moved.parts.ends[c][point] += step;
    const int most = problem_.isSigned ? (1 << (m.precision - 1)) - 1 : (1 << m.precision) - 1;
    const int least = problem_.isSigned ? -most : 0;
    if (moved.parts.ends[c][point] < least || moved.parts.ends[c][point] > most) return false;
    if (!fits(m, moved.parts.ends[c], c)) return false;
    const std::size_t region = point / 2;
    chooseIndices(moved, region, regions_[region]);
    if (!(moved.error() < best_.error())) return false;
    best_ = moved;
    return true;
  }

  const Problem problem_;
  Candidate best_;
  std::array<Region, 2> regions_{};
};

}  // namespace

Block encode(const Texels& texels, bool isSigned) { return Encoder(texels, isSigned).run(); }

}  // namespace lumel::bc6h
