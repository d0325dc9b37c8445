// Which texels an audit looks at, and with which weight.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"
#include "scene/image.h"

namespace lumel {

/// A texel that was drawn, and what was found there.
struct AuditDraw {
  std::uint32_t texel = 0;  // of the population
  std::uint32_t seed = 0;   // of its paths
  double weight = 0.0;      // one over the probability to be drawn, so that sums stand for all texels; 0: not judged
  double map = 0.0;         // luminance of the finished map
  double paths = 0.0;       // luminance by path tracing
  Vec3 position{0};         // world
};

/// The covered texels of all pages, numbered through page by page, with their brightness and objects.
class AuditPopulation {
 public:
  /// The decade of charts without light, or with less than 1e-30.
  static constexpr int kDarkest = -31;

  AuditPopulation(const Atlas& atlas, const std::vector<PageTexels>& texels, std::span<const Image* const> flat);

  std::size_t size() const { return decades_.size(); }
  double meanLight() const { return meanLight_; }
  int darkest() const { return darkest_; }
  int brightest() const { return brightest_; }
  /// By the mean luminance of the texel's chart: decade d holds 10^d to 10^(d + 1).
  int decadeOf(std::uint32_t texel) const { return decades_[texel]; }
  std::uint32_t objectOf(std::uint32_t texel) const { return objects_[texel]; }
  std::uint32_t pageOf(std::uint32_t texel) const;
  std::size_t indexOnPage(std::uint32_t texel) const { return texel - firstOfPage_[pageOf(texel)]; }
  TexelCoord coordOf(std::uint32_t texel) const { return texels_[pageOf(texel)].coords[indexOnPage(texel)]; }

  std::span<const std::uint32_t> everyTexel() const { return byDecade_; }
  std::span<const std::uint32_t> ofDecades(int from, int to) const;
  std::span<const std::uint32_t> ofObject(std::uint32_t object) const;

  /// `count` independent draws by the mixture of audit().
  std::vector<AuditDraw> draw(std::size_t count, std::uint64_t seed) const;
  /// `count` independent draws, even over `texels`.
  std::vector<AuditDraw> drawFrom(std::span<const std::uint32_t> texels, std::size_t count, std::uint64_t seed) const;

 private:
  const std::vector<PageTexels>& texels_;
  std::vector<std::uint32_t> firstOfPage_;  // [pages + 1]
  std::vector<std::int8_t> decades_;
  std::vector<std::uint32_t> objects_;
  std::vector<std::uint32_t> byDecade_, byObject_;            // texels, sorted
  std::vector<std::uint32_t> firstOfDecade_, firstOfObject_;  // into these; one more than there are
  std::vector<std::uint32_t> usedDecades_, usedObjects_;      // that have texels
  int darkest_ = 0;
  int brightest_ = 0;
  double meanLight_ = 0.0;
};

}  // namespace lumel
