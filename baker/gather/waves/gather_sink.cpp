#include "baker/gather/waves/gather_sink.h"

#include <algorithm>

namespace lumel {

void GatherSink::judgePoints(const NetRange& net) {
  const std::uint32_t each = net.count() / WavePoints::kMost;
  for (std::size_t lane = 0; lane < coords.size(); ++lane) {
    if (each >= 2) result.texels[lane].inside.addNet(backs[lane], each);
    for (std::uint32_t i = net.first; i < std::min(net.first + net.count(), std::uint32_t{kWarmRays}); ++i)
      result.texels[lane].firstBacks |= std::uint32_t{backs[lane][i - net.first]} << i;
  }
  backs = {};
}

void GatherSink::finish() {
  settle(sums, maps, totals);
  for (std::size_t lane = 0; lane < coords.size(); ++lane) {
    const auto map = [&](std::size_t i) {
      return Vec3d(totals.sum[3 * i][lane], totals.sum[3 * i + 1][lane], totals.sum[3 * i + 2][lane]);
    };
    result.texels[lane].flat += map(0);
    for (std::size_t i = 0; i < maps; ++i) result.texels[lane].maps[i] += map(i + 1);
  }
  totals = {};
}

}  // namespace lumel
