// Bilinear lookups in a page, as engines make them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "lightmap/seams/seam_maps.h"

namespace lumel {

/// The four texels that a lookup reads, and their weights. Beyond the page's borders its last texels are read.
struct Lookup {
  std::array<std::uint32_t, 4> texels{};  // row by row
  std::array<float, 4> weights{};
};

/// `place` in texels from the page's corner; texel (0, 0) has its middle at (0.5, 0.5).
inline Lookup lookupAt(const Vec2d& place, int width, int height) {
  const auto cell = [](double x, int size) {
    const double inside = std::clamp(x - 0.5, 0.0, static_cast<double>(size - 1));
    const int first = std::min(static_cast<int>(inside), std::max(size - 2, 0));
    return std::pair(first, static_cast<float>(inside - first));
  };
  const auto [x, fx] = cell(place.x, width);
  const auto [y, fy] = cell(place.y, height);
  const int right = std::min(x + 1, width - 1), below = std::min(y + 1, height - 1);
  const auto at = [width](int column, int row) { return static_cast<std::uint32_t>(row * width + column); };
  return {{at(x, y), at(right, y), at(x, below), at(right, below)},
          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

inline Lookup lookupAt(const Vec2d& place, const SeamPage& page) {
  return lookupAt(place, page.flat->width, page.flat->height);
}

/// Weights below this are rounding: such a texel is not read.
inline constexpr float kLeastTap = 1e-3f;

/// The share of a lookup that falls on texels of a state.
inline float shareOf(const Lookup& lookup, const SeamPage& page, TexelState state) {
  float share = 0.0f;
  for (std::size_t k = 0; k < 4; ++k)
    if (page.states[lookup.texels[k]] == state) share += lookup.weights[k];
  return share;
}

/// What is kept of a texel while seams are mended: all maps such that neighbours across a seam are alike. Per colour:
/// the flat map; what the maps decode to on the surface's own normal but for a vector; and that vector in world space.
/// One map: itself, and no vector. RNM: the mean, and sum map_i B_i along the surface. SH L1: L0 and L.
struct SeamLight {
  static constexpr std::size_t kValues = 15;
  std::array<double, kValues> values{};

  void add(const SeamLight& other, double factor) {
    for (std::size_t i = 0; i < kValues; ++i) values[i] += factor * other.values[i];
  }
  double luminanceOfFlat() const { return 0.2126 * values[0] + 0.7152 * values[1] + 0.0722 * values[2]; }
};

SeamLight readLight(const SeamPage& page, std::uint32_t texel, const Frame& frame);
/// Values below zero become zero, and the mean of RNM maps stays; the vector of SH L1 may point where it will.
void writeLight(const SeamLight& light, const Frame& frame, std::uint32_t texel, SeamPage& page);

/// What a lookup reads of known texels, of texels beyond as well if asked for, as if there were no others; and how much
/// of it they are.
struct PartialLight {
  SeamLight light;
  float share = 0.0f;
};
PartialLight readPart(const SeamPage& page, const Lookup& lookup, const Frame& frame, bool alsoBeyond);

/// The place on the other side of a pair that continues a texel's middle.
inline Vec2d placeAcross(const Seams& seams, const BeyondTexel& beyond, int width) {
  const SeamPair& pair = seams.pairs[beyond.pair];
  const Vec2d middle(beyond.texel % static_cast<std::uint32_t>(width) + 0.5,
                     beyond.texel / static_cast<std::uint32_t>(width) + 0.5);
  const Vec2d alongOut = pair.sides[beyond.side].inMetres(middle);
  return pair.sides[1 - beyond.side].at({alongOut.x, -alongOut.y});
}

}  // namespace lumel
