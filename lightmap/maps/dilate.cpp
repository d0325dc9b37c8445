#include "lightmap/maps/dilate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

struct Neighbour {
  int dx;
  int dy;
};
constexpr std::array<Neighbour, 8> kNeighbours = {
    {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};

/// Calls visit(index) for each of the texel's 8 neighbours inside the image, always in the same order.
template <class Visit>
void forEachNeighbour(int width, int height, std::size_t texel, Visit&& visit) {
  const int x = static_cast<int>(texel % static_cast<std::size_t>(width));
  const int y = static_cast<int>(texel / static_cast<std::size_t>(width));
  for (const Neighbour& n : kNeighbours) {
    const int u = x + n.dx;
    const int v = y + n.dy;
    if (u < 0 || v < 0 || u >= width || v >= height) continue;
    visit(static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u));
  }
}

/// Sets each texel of `ring` to the mean of its neighbours for which known(texel, neighbour), in parallel: the ring's
/// own texels are not known yet, so the order does not matter.
template <class Known>
void fillRing(Image& image, std::span<const std::size_t> ring, const Known& known) {
  const auto channels = static_cast<std::size_t>(image.channels);
  parallelFor(ring.size(), 1024, [&](std::size_t first, std::size_t last) {
    std::vector<double> sum(channels);
    for (std::size_t k = first; k < last; ++k) {
      std::fill(sum.begin(), sum.end(), 0.0);
      int count = 0;
      forEachNeighbour(image.width, image.height, ring[k], [&](std::size_t other) {
        if (!known(ring[k], other)) return;
        ++count;
        for (std::size_t c = 0; c < channels; ++c) sum[c] += image.pixels[other * channels + c];
      });
      for (std::size_t c = 0; c < channels; ++c)
        image.pixels[ring[k] * channels + c] = static_cast<float>(sum[c] / count);
    }
  });
}

/// Fills `wanted` texels ring by ring from the known ones; known(texel, neighbour) tells what a texel may read,
/// setKnown(texel) is called for each one filled. Returns when nothing more can be reached, or after maxRings.
template <class Wanted, class Known, class SetKnown>
void growInto(Image& image, int maxRings, const Wanted& wanted, const Known& known, const SetKnown& setKnown) {
  const std::size_t count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const auto touchesKnown = [&](std::size_t texel) {
    bool touches = false;
    forEachNeighbour(image.width, image.height, texel,
                     [&](std::size_t other) { touches = touches || known(texel, other); });
    return touches;
  };
  std::vector<std::size_t> ring;
  for (std::size_t i = 0; i < count; ++i)
    if (wanted(i) && touchesKnown(i)) ring.push_back(i);
  for (int k = 0; k < maxRings && !ring.empty(); ++k) {
    fillRing(image, ring, known);
    for (const std::size_t texel : ring) setKnown(texel);
    // The next ring is among this one's neighbours.
    std::vector<std::size_t> next;
    for (const std::size_t texel : ring)
      forEachNeighbour(image.width, image.height, texel, [&](std::size_t other) {
        if (wanted(other) && known(other, texel)) next.push_back(other);
      });
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    ring = std::move(next);
  }
}

bool sameSize(const Image& image, const TexelMask& mask) {
  return image.width == mask.width && image.height == mask.height &&
         mask.known.size() == static_cast<std::size_t>(mask.width) * static_cast<std::size_t>(mask.height);
}

}  // namespace

void dilate(Image& image, TexelMask& mask, int rings) {
  LUMEL_CHECK(sameSize(image, mask));
  growInto(
      image, rings, [&](std::size_t i) { return mask.known[i] == 0; },
      [&](std::size_t, std::size_t other) { return mask.known[other] != 0; },
      [&](std::size_t i) { mask.known[i] = 1; });
}

void fillHoles(Image& image, const TexelMask& valid, const std::vector<std::uint32_t>& chartIds,
               const std::vector<std::uint8_t>& holes) {
  LUMEL_CHECK(sameSize(image, valid));
  LUMEL_CHECK(chartIds.size() == valid.known.size() && holes.size() == valid.known.size());
  std::vector<std::uint8_t> known = valid.known;
  const auto readable = [&](std::size_t texel, std::size_t other) {
    return known[other] != 0 && chartIds[other] == chartIds[texel];
  };
  growInto(
      image, std::numeric_limits<int>::max(), [&](std::size_t i) { return holes[i] != 0 && known[i] == 0; }, readable,
      [&](std::size_t i) { known[i] = 1; });
}

}  // namespace lumel
