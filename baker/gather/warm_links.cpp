#include "baker/gather/warm_links.h"

#include "scene/base/check.h"

namespace lumel {

WarmLinks::WarmLinks(std::size_t texels, std::size_t waves)
    : found_(texels * GatherWave::kWarmRays + kAhead), bins_(texels * GatherWave::kWarmRays), shares_(waves) {
  LUMEL_CHECK(texels < kLight);
}

void WarmLinks::keep(std::size_t wave, std::size_t first, std::span<const CacheLink> found) {
  static const std::uint32_t whole = packWeight(Vec3(1.0f));
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    const CacheLink& link = found[i];
    const bool isTexel = link.texel != kNoTexel;
    found_[first + i] = isTexel ? link.texel : std::bit_cast<std::uint32_t>(-link.light);
    bins_[first + i] = static_cast<std::uint8_t>(link.bin);
    if (isTexel && link.weight != whole) shares_[wave].push_back({i, link.weight});
  }
}

}  // namespace lumel
