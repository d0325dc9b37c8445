// The links of the warm-up: what each of a few rays of every texel found, kept so that light can be passed along them
// again and again without tracing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/waves/warm_wave.h"

namespace lumel {

/// kWarmRays links for each texel, numbered through: 4 bytes each, and 8 more for those that pass on only a
/// share.
class WarmLinks {
 public:
  WarmLinks(std::size_t texels, std::size_t waves);

  /// Enters a wave's links, from link `first` on. Different waves may be entered from several threads at once.
  void keep(std::size_t wave, std::size_t first, std::span<const CacheLink> found);

  class Reader;

 private:
  struct Share {
    std::uint32_t link = 0;  // of the wave: texel * kWarmRays + ray
    std::uint32_t weight = 0;
  };
  static constexpr std::uint32_t kAhead = 32;

  std::vector<std::uint32_t> found_;        // the texel; kNoTexel: none
  std::vector<std::vector<Share>> shares_;  // per wave, in order
};

/// The links of a wave one by one.
class WarmLinks::Reader {
 public:
  Reader(const WarmLinks& links, std::size_t wave, std::size_t first)
      : found_(links.found_.data() + first), share_(links.shares_[wave].begin()), end_(links.shares_[wave].end()) {}

  bool isTexel() const { return found_[at_] != kNoTexel; }
  std::uint32_t texel() const { return found_[at_]; }
  /// What the texel of the link passes on; once for each link. Asks memory for what a later link will.
  Vec3 lightOf(std::span<const Vec3> reflected) {
    const std::uint32_t later = found_[at_ + kAhead];
    __builtin_prefetch(reflected.data() + (later != kNoTexel ? later : 0u));
    const Vec3 light = reflected[found_[at_]];
    return share_ != end_ && share_->link == at_ ? light * unpackWeight(share_++->weight) : light;
  }
  void next() { ++at_; }

 private:
  const std::uint32_t* found_;
  std::vector<Share>::const_iterator share_, end_;
  std::uint32_t at_ = 0;
};

}  // namespace lumel
