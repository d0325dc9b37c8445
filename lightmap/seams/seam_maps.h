// Seams in finished maps: texels beyond the borders of charts take the light of what continues there, and lookups from
// both sides of a seam are made to agree.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/seams/seams.h"
#include "scene/image.h"

namespace lumel {

enum class TexelState : std::uint8_t {
  Empty,   // without a value of its own
  Known,   // baked
  Hole,    // covered, but what was baked does not count: no seam is mended beside it
  Beyond,  // empty before, now with the light that continues across a seam
};

/// Whether seams in the maps of such an encoding can be mended: of those with one map (flat), three (RNM) or four (SH
/// L1).
inline bool canMend(std::size_t mapCount) { return mapCount == 1 || mapCount == 3 || mapCount == 4; }

/// A page of the maps. All images have its size and RGB.
struct SeamPage {
  Image* flat = nullptr;
  std::span<Image> maps;             // of an encoding that canMend
  std::vector<TexelState> states;    // row by row
  std::span<const float> errors;     // standard error of the flat map's luminance, `stride` floats apart
  std::span<const float> coverages;  // share of the texel's area, as far apart
  std::size_t stride = 1;
  bool isSigned = false;  // whether maps may be negative
};

/// An empty texel that a lookup at a seam reads; what it should hold lies on the other side.
struct BeyondTexel {
  std::uint32_t page = 0;
  std::uint32_t texel = 0;  // index, row by row
  std::uint32_t pair = 0;   // of Seams
  std::uint32_t side = 0;   // whose lookups read it
  bool operator==(const BeyondTexel&) const = default;
};

/// Sorted by page and texel; a texel where seams meet is there once for each of them.
std::vector<BeyondTexel> texelsBeyond(const Seams& seams, std::span<const SeamPage> pages);

/// Sets each texel to what lookups on the other side read at its place, from known texels alone; where those read none,
/// as at the corner of a tile, from other texels beyond, else to the mean of the texels around it. Directions are
/// turned from one side's bake frame to the other's. The texels' states become Beyond.
void continueLight(const Seams& seams, std::span<const BeyondTexel> beyond, std::span<SeamPage> pages);

/// How far lookups from both sides of the seams differ, relative to their mean, in the luminance of the flat map.
struct SeamSteps {
  double rms = 0.0;
  double most = 0.0;
};
struct SeamFigures {
  std::size_t points = 0;
  double texels = 0.0;  // length of all seams
  SeamSteps before;     // as dilation would have it: empty texels do not count
  SeamSteps after;
};

/// After continueLight: solves for the texels that lookups at the seams read, so that both sides agree: weighted least
/// squares, in which known texels stay near their values by their standard error and those beyond near what continues
/// there. All maps and colours get the same matrix, so what holds for them linearly goes on to hold; where bake frames
/// differ, the directional part (sum of map_i B_i, along the surface) agrees in world space. Results are not negative
/// but for maps that may be. Deterministic for any number of threads.
SeamFigures mendSeams(const Seams& seams, std::span<const BeyondTexel> beyond, std::span<SeamPage> pages);

}  // namespace lumel
