#include "baker/gather/waves/gather_sink.h"

namespace lumel {

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
