#include "baker/gather/waves/waves.h"

#include <algorithm>
#include <utility>

namespace lumel {
namespace {

constexpr int kTile = 4;  // side of the tiles that PageTexels are ordered by

}  // namespace

Waves::Waves(const std::vector<PageTexels>& pages) {
  for (std::uint32_t p = 0; p < pages.size(); ++p) addPage(p, pages[p]);
}

void Waves::addPage(std::uint32_t number, const PageTexels& page) {
  const std::size_t firstWave = waves_.size();
  firstWave_.push_back(firstWave);
  firstProbe_.push_back(probes_);
  probes_ += (page.size() + kProbeStride - 1) / kProbeStride;
  const int tilesX = (page.width + kTile - 1) / kTile;
  const int tilesY = (page.height + kTile - 1) / kTile;
  std::vector<std::uint32_t> waveOf(static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY), kNone);
  const auto tileOf = [&](const Wave& wave) {
    const TexelCoord at = page.coords[wave.first + wave.count / 2];
    return std::pair(static_cast<int>(at.x) / kTile, static_cast<int>(at.y) / kTile);
  };
  const auto indexOf = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(tilesX) + static_cast<std::size_t>(x);
  };
  for (std::size_t first = 0; first < page.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, page.size() - first);
    const Wave wave{number, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count),
                    static_cast<std::uint32_t>(texels_)};
    const auto [x, y] = tileOf(wave);
    waveOf[indexOf(x, y)] = static_cast<std::uint32_t>(waves_.size());
    waves_.push_back(wave);
    texels_ += count;
  }
  around_.resize(waves_.size());
  for (std::size_t w = firstWave; w < waves_.size(); ++w) {
    const auto [tileX, tileY] = tileOf(waves_[w]);
    auto next = around_[w].begin();
    for (int y = tileY - 1; y <= tileY + 1; ++y)
      for (int x = tileX - 1; x <= tileX + 1; ++x)
        *next++ = x >= 0 && y >= 0 && x < tilesX && y < tilesY ? waveOf[indexOf(x, y)] : kNone;
    around_[w][4] = static_cast<std::uint32_t>(w);
  }
}

}  // namespace lumel
