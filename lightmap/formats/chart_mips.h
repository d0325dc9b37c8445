// Mip levels of a page that keep charts apart. A texel of a coarser level may lie over two charts; the usual mean would
// carry the light of one into lookups on the other. Here it takes the mean of one chart's texels alone, of that which
// covers most of it, and counts each by the surface that it stands for. What no chart reaches is filled from around, so
// that neither a filter nor a block of texels finds black.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/image.h"

namespace lumel {

/// What lies where on a level of a page, row by row.
struct ChartTexels {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> charts;  // 0: none
  std::vector<float> weights;         // share of the texel that its chart covers; 0: no surface
  std::vector<std::uint8_t> kept;     // of the finest level: texels whose values stand as they are (dilated ones, too)
};

/// The page itself and its coarser levels down to one texel, each half as wide and high, rounded down.
std::vector<ChartTexels> mipTexels(ChartTexels page);

/// The levels of one of the page's maps, the finest as it is but for texels that are not kept, which are filled.
std::vector<Image> mipImages(const Image& map, std::span<const ChartTexels> levels);

}  // namespace lumel
