#include "baker/gather/warm_links.h"

namespace lumel {

WarmLinks::WarmLinks(std::size_t texels, std::size_t waves)
    : found_(texels * kWarmRays + kAhead, kNoTexel), shares_(waves) {}

void WarmLinks::keep(std::size_t wave, std::size_t first, std::span<const CacheLink> found) {
  static const std::uint32_t whole = packWeight(Vec3(1.0f));
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    const CacheLink& link = found[i];
    found_[first + i] = link.texel;
    if (link.texel != kNoTexel && link.weight != whole) shares_[wave].push_back({i, link.weight});
  }
}

}  // namespace lumel
