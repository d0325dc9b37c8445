#include "baker/audit/audit_draws.h"

#include <algorithm>
#include <cmath>

#include "scene/base/math.h"

namespace lumel {
namespace {

constexpr int kDecades = 70;  // from AuditPopulation::kDarkest on: all of float

/// A stream of random numbers: splitmix64 (Steele, Lea and Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// In [0, count).
  std::size_t below(std::size_t count) {
    constexpr double kPerStep = 0x1p-53;
    const double share = static_cast<double>(next() >> 11) * kPerStep;
    return std::min(static_cast<std::size_t>(share * static_cast<double>(count)), count - 1);
  }

 private:
  std::uint64_t state_;
};

int decadeOf(float light) {
  if (!(light > 1e-30f)) return AuditPopulation::kDarkest;
  return std::clamp(static_cast<int>(std::floor(std::log10(light))), AuditPopulation::kDarkest + 1,
                    AuditPopulation::kDarkest + kDecades - 1);
}

/// Counting sort: the items 0 .. keys.size() - 1 by their keys in [0, count).
template <class KeyOf>
void sortByKey(std::size_t items, std::size_t count, KeyOf keyOf, std::vector<std::uint32_t>& sorted,
               std::vector<std::uint32_t>& first, std::vector<std::uint32_t>& used) {
  first.assign(count + 1, 0);
  for (std::size_t i = 0; i < items; ++i) ++first[keyOf(i) + 1];
  for (std::size_t k = 0; k < count; ++k) {
    if (first[k + 1] > 0) used.push_back(static_cast<std::uint32_t>(k));
    first[k + 1] += first[k];
  }
  sorted.resize(items);
  std::vector<std::uint32_t> at(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < items; ++i) sorted[at[keyOf(i)]++] = static_cast<std::uint32_t>(i);
}

std::span<const std::uint32_t> rangeOf(const std::vector<std::uint32_t>& sorted,
                                       const std::vector<std::uint32_t>& first, std::size_t from, std::size_t to) {
  return std::span(sorted).subspan(first[from], first[to] - first[from]);
}

}  // namespace

AuditPopulation::AuditPopulation(const Atlas& atlas, const std::vector<PageTexels>& texels,
                                 std::span<const Image* const> flat)
    : texels_(texels), firstOfPage_{0} {
  std::uint32_t mostObject = 0;
  // A texel's own light would put those into the brightest decade that are too bright by noise.
  std::vector<double> sums(atlas.charts.size()), counts(atlas.charts.size());
  std::vector<std::uint32_t> charts;
  for (std::size_t p = 0; p < texels.size(); ++p) {
    const PageTexels& page = texels[p];
    for (std::size_t i = 0; i < page.size(); ++i) {
      const TexelCoord at = page.coords[i];
      const float* rgb = flat[p]->pixels.data() +
                         3 * (static_cast<std::size_t>(at.y) * static_cast<std::size_t>(flat[p]->width) + at.x);
      const float light = luminance(Vec3(rgb[0], rgb[1], rgb[2]));
      meanLight_ += static_cast<double>(light);
      const TriangleRef& triangle = page.trianglesOf(i).front();
      const Surface& surface = atlas.surfaces[triangle.surface];
      charts.push_back(surface.charts[triangle.triangle]);
      sums[charts.back()] += static_cast<double>(light);
      counts[charts.back()] += 1.0;
      objects_.push_back(static_cast<std::uint32_t>(surface.instance));
      mostObject = std::max(mostObject, objects_.back());
    }
    firstOfPage_.push_back(static_cast<std::uint32_t>(charts.size()));
  }
  for (const std::uint32_t chart : charts)
    decades_.push_back(static_cast<std::int8_t>(lumel::decadeOf(static_cast<float>(sums[chart] / counts[chart]))));
  if (decades_.empty()) return;
  meanLight_ /= static_cast<double>(decades_.size());
  sortByKey(
      decades_.size(), kDecades, [&](std::size_t i) { return static_cast<std::size_t>(decades_[i] - kDarkest); },
      byDecade_, firstOfDecade_, usedDecades_);
  sortByKey(
      decades_.size(), std::size_t{mostObject} + 1, [&](std::size_t i) { return std::size_t{objects_[i]}; }, byObject_,
      firstOfObject_, usedObjects_);
  darkest_ = static_cast<int>(usedDecades_.front()) + kDarkest;
  brightest_ = static_cast<int>(usedDecades_.back()) + kDarkest;
}

std::uint32_t AuditPopulation::pageOf(std::uint32_t texel) const {
  return static_cast<std::uint32_t>(std::ranges::upper_bound(firstOfPage_, texel) - firstOfPage_.begin() - 1);
}

std::span<const std::uint32_t> AuditPopulation::ofDecades(int from, int to) const {
  return rangeOf(byDecade_, firstOfDecade_, static_cast<std::size_t>(from - kDarkest),
                 static_cast<std::size_t>(to + 1 - kDarkest));
}

std::span<const std::uint32_t> AuditPopulation::ofObject(std::uint32_t object) const {
  if (object + std::size_t{1} >= firstOfObject_.size()) return {};
  return rangeOf(byObject_, firstOfObject_, object, std::size_t{object} + 1);
}

std::vector<AuditDraw> AuditPopulation::draw(std::size_t count, std::uint64_t seed) const {
  Random random(seed);
  std::vector<AuditDraw> draws(count);
  for (AuditDraw& draw : draws) {
    const std::size_t way = random.below(3);
    std::span<const std::uint32_t> from = byDecade_;
    if (way == 1) {
      const auto decade = static_cast<int>(usedDecades_[random.below(usedDecades_.size())]) + kDarkest;
      from = ofDecades(decade, decade);
    } else if (way == 2) {
      from = ofObject(usedObjects_[random.below(usedObjects_.size())]);
    }
    draw.texel = from[random.below(from.size())];
    draw.seed = static_cast<std::uint32_t>(random.next());
    const int decade = decadeOf(draw.texel);
    const double probability =
        (1.0 / static_cast<double>(size()) +
         1.0 / (static_cast<double>(usedDecades_.size()) * static_cast<double>(ofDecades(decade, decade).size())) +
         1.0 /
             (static_cast<double>(usedObjects_.size()) * static_cast<double>(ofObject(objectOf(draw.texel)).size()))) /
        3.0;
    draw.weight = 1.0 / probability;
  }
  return draws;
}

std::vector<AuditDraw> AuditPopulation::drawFrom(std::span<const std::uint32_t> texels, std::size_t count,
                                                 std::uint64_t seed) const {
  Random random(seed);
  std::vector<AuditDraw> draws(count);
  for (AuditDraw& draw : draws) {
    draw.texel = texels[random.below(texels.size())];
    draw.seed = static_cast<std::uint32_t>(random.next());
    draw.weight = 1.0;
  }
  return draws;
}

}  // namespace lumel
