#include "baker/finish.h"

#include "lightmap/dilate.h"
#include "scene/parallel.h"

namespace lumel {

void dilatePages(std::vector<BakedPage>& pages, int rings) {
  if (rings <= 0) return;
  constexpr std::size_t kMaps = 4;
  parallelFor(pages.size() * kMaps, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      BakedPage& page = pages[i / kMaps];
      TexelMask mask{page.aux.width, page.aux.height, {}};
      mask.known.reserve(page.aux.pixels.size() / 4);
      for (std::size_t texel = 0; texel < page.aux.pixels.size(); texel += 4)
        mask.known.push_back(page.aux.pixels[texel] > 0.0f ? 1 : 0);
      dilate(i % kMaps < 3 ? page.rnm[i % kMaps] : page.flat, mask, rings);
    }
  });
}

}  // namespace lumel
