// mendSeams of seam_maps.h.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "lightmap/seams/least_squares.h"
#include "lightmap/seams/lookup.h"
#include "lightmap/seams/seam_maps.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Least error of a texel, as a share of its light: where noise is less, filtering errs by so much.
constexpr double kLeastError = 0.003;
/// How far off its middle, in texels, a partly covered texel holds the light, times its uncovered share. Half a texel
/// at most; with 0 to 0.2 lookups at slanted borders come nearest to
/// those in one piece.
constexpr double kOffMiddle = 0.2;
/// By how much better sides agree than texels are known; and their tolerance as a share of the step before: where
/// texels are too coarse for the light, they are not bent to meet at any price.
constexpr double kTightness = 30.0;
constexpr double kLeftOfStep = 0.05;
/// Error of what lookups on the other side say of a texel beyond: over that of the texels they read, and as a share of
/// how far these differ.
constexpr double kAcross = 3.0;
constexpr double kAcrossSpread = 0.1;
/// Error, as a share of the light around, of an empty texel of which nothing is known.
constexpr double kUnknown = 0.2;
/// Points do not count of which more lies on holes, or less on what texels cover: thinner slivers hold the light of a
/// sliver, and bending them to meet at their borders would change all of it.
constexpr float kMostHoles = 0.01f;
constexpr float kLeastCovered = 0.2f;
/// Light whose sides differ by more than this factor has an edge there, or one side lies hidden: the crossing's ray has
/// missed what stands on the seam.
constexpr double kMostRatio = 3.0;

/// A texel that would change by more than this factor is held by its value the more, in further rounds: where texels
/// are too coarse for the light, lookups cannot meet.
constexpr double kMostChange = 2.0;
constexpr double kStiffening = 100.0;
constexpr int kRounds = 3;

constexpr std::uint32_t kNone = ~0u;

/// Numbers the texels of all pages that are marked, in order.
class TexelNumbers {
 public:
  explicit TexelNumbers(std::span<const SeamPage> pages) {
    std::size_t words = 0;
    for (const SeamPage& page : pages) {
      firstWord_.push_back(words);
      words += (page.states.size() + 63) / 64;
    }
    bits_.assign(words, 0);
  }
  void mark(std::uint32_t page, std::uint32_t texel) {
    bits_[firstWord_[page] + texel / 64] |= std::uint64_t{1} << texel % 64;
  }
  bool isMarked(std::uint32_t page, std::uint32_t texel) const {
    return (bits_[firstWord_[page] + texel / 64] >> texel % 64 & 1) != 0;
  }
  /// After the last mark. Returns how many there are.
  std::uint32_t number() {
    before_.resize(bits_.size());
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      before_[i] = count;
      count += static_cast<std::uint32_t>(std::popcount(bits_[i]));
    }
    return count;
  }
  std::uint32_t of(std::uint32_t page, std::uint32_t texel) const {
    const std::size_t word = firstWord_[page] + texel / 64;
    return before_[word] +
           static_cast<std::uint32_t>(std::popcount(bits_[word] & ((std::uint64_t{1} << texel % 64) - 1)));
  }
  /// Calls visit(page, texel) for all marked texels in order.
  template <class Visit>
  void forEach(Visit&& visit) const {
    for (std::size_t page = 0; page < firstWord_.size(); ++page) {
      const std::size_t end = page + 1 < firstWord_.size() ? firstWord_[page + 1] : bits_.size();
      for (std::size_t word = firstWord_[page]; word < end; ++word)
        for (std::uint64_t rest = bits_[word]; rest != 0; rest &= rest - 1)
          visit(static_cast<std::uint32_t>(page),
                static_cast<std::uint32_t>((word - firstWord_[page]) * 64 +
                                           static_cast<std::size_t>(std::countr_zero(rest))));
    }
  }

 private:
  std::vector<std::size_t> firstWord_;  // per page
  std::vector<std::uint64_t> bits_;
  std::vector<std::uint32_t> before_;  // marks before each word
};

struct Unknown {
  std::uint32_t page = 0;
  std::uint32_t texel = 0;
  std::uint32_t group = 0;  // the root of its tree first, then the group's number
  std::uint32_t local = 0;  // its number in the group
  double error = 0.0;       // of its value
  double stiffness = 1.0;   // factor to the weight of its value
  bool isKnown = false;
  Frame frame;
  SeamLight light;  // before
};

/// The lookups of both sides at a point.
std::array<Lookup, 2> lookupsAt(const Seams& seams, const SeamPoint& point, std::span<const SeamPage> pages) {
  std::array<Lookup, 2> both;
  for (std::size_t k = 0; k < 2; ++k) {
    const SeamSide& side = seams.pairs[point.pair].sides[k];
    both[k] = lookupAt(side.at({static_cast<double>(point.metres), 0.0}), pages[side.page]);
  }
  return both;
}

/// The share of a lookup that falls on covered parts of known texels.
float coveredShare(const Lookup& lookup, const SeamPage& page) {
  float share = 0.0f;
  for (std::size_t k = 0; k < 4; ++k)
    if (page.states[lookup.texels[k]] == TexelState::Known)
      share += lookup.weights[k] * std::min(page.coverages[lookup.texels[k] * page.stride], 1.0f);
  return share;
}

double flatAt(const SeamPage& page, std::uint32_t texel) {
  const float* pixel = page.flat->pixels.data() + std::size_t{3} * texel;
  return static_cast<double>(luminance(Vec3(pixel[0], pixel[1], pixel[2])));
}

/// How far a texel and the known ones beside it (four) differ at most.
double spreadAround(const SeamPage& page, std::uint32_t texel) {
  const auto width = static_cast<std::uint32_t>(page.flat->width);
  const std::uint32_t x = texel % width;
  double low = flatAt(page, texel), high = low;
  const auto see = [&](std::uint32_t other) {
    if (page.states[other] != TexelState::Known) return;
    low = std::min(low, flatAt(page, other));
    high = std::max(high, flatAt(page, other));
  };
  if (x > 0) see(texel - 1);
  if (x + 1 < width) see(texel + 1);
  if (texel >= width) see(texel - width);
  if (texel + width < page.states.size()) see(texel + width);
  return high - low;
}

struct Group {
  std::vector<std::uint32_t> unknowns, points, beyond;
};

SeamLight moved(const Unknown& unknown, std::span<const double> moves) {
  SeamLight light = unknown.light;
  for (std::size_t c = 0; c < SeamLight::kValues; ++c) light.values[c] += moves[unknown.local * SeamLight::kValues + c];
  return light;
}

class Mender {
 public:
  Mender(const Seams& seams, std::span<const BeyondTexel> beyond, std::span<SeamPage> pages)
      : seams_(seams), beyond_(beyond), pages_(pages), numbers_(pages) {}

  SeamFigures run();

 private:
  void chooseUnknowns();
  void readUnknowns();
  void joinGroups();
  void solve(std::uint32_t group);
  bool stiffen(const Group& group, std::span<const double> moves);
  void addPoint(const SeamPoint& point, LeastSquares& system) const;
  void addBeyond(const BeyondTexel& texel, LeastSquares& system) const;
  void addOwn(const Unknown& unknown, LeastSquares& system) const;
  void addTaps(std::uint32_t page, const Lookup& lookup, double factor, SparseRow& row, SeamLight& residual,
               double& error) const;
  SeamSteps steps(bool mended) const;

  std::uint32_t rootOf(std::uint32_t i) {
    while (unknowns_[i].group != i) i = unknowns_[i].group = unknowns_[unknowns_[i].group].group;
    return i;
  }
  /// Puts all texels that are read, and are unknowns, into one group.
  void join(std::uint32_t page, const Lookup& lookup, std::uint32_t& first) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (!(lookup.weights[k] > kLeastTap) || !numbers_.isMarked(page, lookup.texels[k])) continue;
      const std::uint32_t root = rootOf(numbers_.of(page, lookup.texels[k]));
      if (first == kNone) first = root;
      const std::uint32_t other = rootOf(first);
      unknowns_[std::max(root, other)].group = std::min(root, other);
    }
  }

  const Seams& seams_;
  std::span<const BeyondTexel> beyond_;
  std::span<SeamPage> pages_;
  TexelNumbers numbers_;
  std::vector<SeamPoint> points_;  // those that count
  std::vector<Unknown> unknowns_;
  std::vector<Group> groups_;
};

void Mender::chooseUnknowns() {
  for (const SeamPoint& point : seams_.points) {
    const SeamPair& pair = seams_.pairs[point.pair];
    const std::array<Lookup, 2> lookups = lookupsAt(seams_, point, pages_);
    bool counts = true;
    std::array<double, 2> light{};
    for (std::size_t k = 0; k < 2; ++k) {
      const SeamPage& page = pages_[pair.sides[k].page];
      counts = counts && shareOf(lookups[k], page, TexelState::Hole) <= kMostHoles &&
               coveredShare(lookups[k], page) >= kLeastCovered;
      light[k] = readPart(page, lookups[k], pair.sides[k].frame, false).light.luminanceOfFlat();
    }
    counts = counts && std::max(light[0], light[1]) <= kMostRatio * std::min(light[0], light[1]);
    if (!counts) continue;
    points_.push_back(point);
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t tap = 0; tap < 4; ++tap)
        if (lookups[k].weights[tap] > kLeastTap) numbers_.mark(pair.sides[k].page, lookups[k].texels[tap]);
  }
  // What is said of texels beyond makes unknowns of the known texels that it reads.
  for (const BeyondTexel& texel : beyond_) {
    if (!numbers_.isMarked(texel.page, texel.texel)) continue;
    const std::uint32_t other = seams_.pairs[texel.pair].sides[1 - texel.side].page;
    const Lookup lookup = lookupAt(placeAcross(seams_, texel, pages_[texel.page].flat->width), pages_[other]);
    for (std::size_t tap = 0; tap < 4; ++tap)
      if (lookup.weights[tap] > kLeastTap && pages_[other].states[lookup.texels[tap]] == TexelState::Known)
        numbers_.mark(other, lookup.texels[tap]);
  }
}

void Mender::readUnknowns() {
  unknowns_.resize(numbers_.number());
  std::uint32_t next = 0;
  numbers_.forEach([&](std::uint32_t page, std::uint32_t texel) {
    Unknown& unknown = unknowns_[next];
    unknown.page = page;
    unknown.texel = texel;
    unknown.group = next++;
    unknown.isKnown = pages_[page].states[texel] != TexelState::Beyond;
  });
  // The frame is that of the first seam that reads the texel: it is used to turn values there and back alone.
  std::vector<std::uint8_t> hasFrame(unknowns_.size(), 0);
  const auto give = [&](std::uint32_t page, const Lookup& lookup, const Frame& frame) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (!(lookup.weights[k] > kLeastTap) || !numbers_.isMarked(page, lookup.texels[k])) continue;
      const std::uint32_t i = numbers_.of(page, lookup.texels[k]);
      if (hasFrame[i] != 0) continue;
      hasFrame[i] = 1;
      unknowns_[i].frame = frame;
    }
  };
  for (const SeamPoint& point : points_) {
    const std::array<Lookup, 2> lookups = lookupsAt(seams_, point, pages_);
    for (std::size_t k = 0; k < 2; ++k)
      give(seams_.pairs[point.pair].sides[k].page, lookups[k], seams_.pairs[point.pair].sides[k].frame);
  }
  for (const BeyondTexel& texel : beyond_) {
    const SeamSide& other = seams_.pairs[texel.pair].sides[1 - texel.side];
    give(other.page, lookupAt(placeAcross(seams_, texel, pages_[texel.page].flat->width), pages_[other.page]),
         other.frame);
  }
  parallelFor(unknowns_.size(), 1024, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      Unknown& unknown = unknowns_[i];
      const SeamPage& page = pages_[unknown.page];
      unknown.light = readLight(page, unknown.texel, unknown.frame);
      const auto stated = static_cast<double>(page.errors[unknown.texel * page.stride]);
      const double light = std::abs(unknown.light.luminanceOfFlat());
      unknown.error = std::max({kLeastError * light, unknown.isKnown && std::isfinite(stated) ? stated : 0.0, 1e-30});
      // A partly covered texel holds the light of its covered part, off its middle.
      const double uncovered = 1.0 - std::min(1.0, static_cast<double>(page.coverages[unknown.texel * page.stride]));
      if (unknown.isKnown) unknown.error += kOffMiddle * uncovered * spreadAround(page, unknown.texel);
    }
  });
}

void Mender::joinGroups() {
  std::vector<std::uint32_t> firstOfPoint(points_.size(), kNone);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::array<Lookup, 2> lookups = lookupsAt(seams_, points_[i], pages_);
    for (std::size_t k = 0; k < 2; ++k) join(seams_.pairs[points_[i].pair].sides[k].page, lookups[k], firstOfPoint[i]);
  }
  std::vector<std::uint32_t> firstOfBeyond(beyond_.size(), kNone);
  for (std::size_t i = 0; i < beyond_.size(); ++i) {
    const BeyondTexel& texel = beyond_[i];
    if (!numbers_.isMarked(texel.page, texel.texel)) continue;
    const std::uint32_t other = seams_.pairs[texel.pair].sides[1 - texel.side].page;
    firstOfBeyond[i] = numbers_.of(texel.page, texel.texel);
    join(other, lookupAt(placeAcross(seams_, texel, pages_[texel.page].flat->width), pages_[other]), firstOfBeyond[i]);
  }
  std::vector<std::uint32_t> groupOf(unknowns_.size(), kNone);
  for (std::uint32_t i = 0; i < unknowns_.size(); ++i) {
    const std::uint32_t root = rootOf(i);
    if (groupOf[root] == kNone) {
      groupOf[root] = static_cast<std::uint32_t>(groups_.size());
      groups_.emplace_back();
    }
    groupOf[i] = groupOf[root];
  }
  for (std::uint32_t i = 0; i < unknowns_.size(); ++i) {
    std::vector<std::uint32_t>& members = groups_[groupOf[i]].unknowns;
    unknowns_[i].group = groupOf[i];
    unknowns_[i].local = static_cast<std::uint32_t>(members.size());
    members.push_back(i);
  }
  for (std::uint32_t i = 0; i < points_.size(); ++i) groups_[groupOf[firstOfPoint[i]]].points.push_back(i);
  for (std::uint32_t i = 0; i < beyond_.size(); ++i)
    if (firstOfBeyond[i] != kNone) groups_[groupOf[firstOfBeyond[i]]].beyond.push_back(i);
}

/// Adds a lookup to an equation; `residual` loses what the lookup reads now, `error` gains that of its texels.
void Mender::addTaps(std::uint32_t page, const Lookup& lookup, double factor, SparseRow& row, SeamLight& residual,
                     double& error) const {
  for (std::size_t k = 0; k < 4; ++k) {
    if (!(lookup.weights[k] > kLeastTap) || !numbers_.isMarked(page, lookup.texels[k])) continue;
    const Unknown& unknown = unknowns_[numbers_.of(page, lookup.texels[k])];
    const auto weight = static_cast<double>(lookup.weights[k]);
    row.add(unknown.local, factor * weight);
    residual.add(unknown.light, -factor * weight);
    error += weight * unknown.error;
  }
}

void Mender::addPoint(const SeamPoint& point, LeastSquares& system) const {
  const SeamPair& pair = seams_.pairs[point.pair];
  const std::array<Lookup, 2> lookups = lookupsAt(seams_, point, pages_);
  SparseRow row;
  SeamLight residual;
  double error = 0.0;
  addTaps(pair.sides[0].page, lookups[0], 1.0, row, residual, error);
  addTaps(pair.sides[1].page, lookups[1], -1.0, row, residual, error);
  const double scale = 1.0 / (0.5 * error / kTightness + kLeftOfStep * std::abs(residual.luminanceOfFlat()));
  system.add(row, static_cast<double>(point.texels) * scale * scale, residual.values);
}

void Mender::addBeyond(const BeyondTexel& texel, LeastSquares& system) const {
  const SeamSide& other = seams_.pairs[texel.pair].sides[1 - texel.side];
  const SeamPage& page = pages_[other.page];
  const Lookup lookup = lookupAt(placeAcross(seams_, texel, pages_[texel.page].flat->width), page);
  SparseRow row;
  SeamLight residual;
  double error = 0.0;
  addTaps(other.page, lookup, 1.0, row, residual, error);
  double share = 0.0;
  for (std::size_t k = 0; k < row.count; ++k) share += row.factors[k];
  if (share < 0.999) return;  // it would read what is not solved for
  const Unknown& own = unknowns_[numbers_.of(texel.page, texel.texel)];
  row.add(own.local, -1.0);
  residual.add(own.light, 1.0);
  double low = own.light.luminanceOfFlat(), high = low;
  for (const std::uint32_t tap : lookup.texels) {
    low = std::min(low, flatAt(page, tap));
    high = std::max(high, flatAt(page, tap));
  }
  const auto known = static_cast<double>(shareOf(lookup, page, TexelState::Known));
  const double scale = 1.0 / std::max(kAcross * error + kAcrossSpread * (high - low), 1e-30);
  system.add(row, std::max(known * known, 0.01) * scale * scale, residual.values);
}

void Mender::addOwn(const Unknown& unknown, LeastSquares& system) const {
  SparseRow row;
  row.add(unknown.local, 1.0);
  const double error =
      unknown.isKnown ? unknown.error : std::max(unknown.error, kUnknown * std::abs(unknown.light.luminanceOfFlat()));
  system.add(row, unknown.stiffness / (error * error), SeamLight{}.values);
}

void Mender::solve(std::uint32_t group) {
  const Group& g = groups_[group];
  std::vector<double> moves;
  for (int round = 0; round < kRounds; ++round) {
    LeastSquares system(g.unknowns.size(), SeamLight::kValues);
    for (const std::uint32_t i : g.unknowns) addOwn(unknowns_[i], system);
    for (const std::uint32_t i : g.beyond) addBeyond(beyond_[i], system);
    for (const std::uint32_t i : g.points) addPoint(points_[i], system);
    moves = system.solve();
    if (moves.empty()) return;
    if (!stiffen(g, moves)) break;
  }
  for (const std::uint32_t i : g.unknowns) {
    const Unknown& unknown = unknowns_[i];
    const SeamLight light = moved(unknown, moves);
    if (std::ranges::all_of(light.values, [](double value) { return std::isfinite(value); }))
      writeLight(light, unknown.frame, unknown.texel, pages_[unknown.page]);
  }
}

/// Holds those texels by their values that would change by more than kMostChange. Returns whether there are any.
bool Mender::stiffen(const Group& group, std::span<const double> moves) {
  bool any = false;
  for (const std::uint32_t i : group.unknowns) {
    Unknown& unknown = unknowns_[i];
    const double before = unknown.light.luminanceOfFlat();
    const double after = moved(unknown, moves).luminanceOfFlat();
    if (after <= kMostChange * before && before <= kMostChange * after) continue;
    unknown.stiffness *= kStiffening;
    any = true;
  }
  return any;
}

SeamSteps Mender::steps(bool mended) const {
  SeamSteps steps;
  double squares = 0.0, texels = 0.0;
  for (const SeamPoint& point : points_) {
    const std::array<Lookup, 2> lookups = lookupsAt(seams_, point, pages_);
    std::array<double, 2> read{};
    for (std::size_t k = 0; k < 2; ++k) {
      const SeamPage& page = pages_[seams_.pairs[point.pair].sides[k].page];
      double share = 0.0;
      for (std::size_t tap = 0; tap < 4; ++tap) {
        const std::uint32_t texel = lookups[k].texels[tap];
        if (!mended && page.states[texel] != TexelState::Known) continue;
        const auto weight = static_cast<double>(lookups[k].weights[tap]);
        read[k] += weight * flatAt(page, texel);
        share += weight;
      }
      read[k] /= share;
    }
    if (!(read[0] + read[1] > 0.0)) continue;
    const double step = 2.0 * std::abs(read[0] - read[1]) / (read[0] + read[1]);
    squares += static_cast<double>(point.texels) * step * step;
    texels += static_cast<double>(point.texels);
    steps.most = std::max(steps.most, step);
  }
  if (texels > 0.0) steps.rms = std::sqrt(squares / texels);
  return steps;
}

SeamFigures Mender::run() {
  chooseUnknowns();
  SeamFigures figures;
  figures.points = points_.size();
  for (const SeamPoint& point : points_) figures.texels += static_cast<double>(point.texels);
  figures.before = steps(false);
  readUnknowns();
  joinGroups();
  parallelFor(groups_.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t g = first; g < last; ++g) solve(static_cast<std::uint32_t>(g));
  });
  figures.after = steps(true);
  return figures;
}

}  // namespace

SeamFigures mendSeams(const Seams& seams, std::span<const BeyondTexel> beyond, std::span<SeamPage> pages) {
  return Mender(seams, beyond, pages).run();
}

}  // namespace lumel
