#include "baker/bake/finish.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "lightmap/maps/denoise.h"
#include "lightmap/maps/dilate.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr float kLeastValidity = 0.5f;
constexpr std::size_t kTexelsPerTask = 1024;

/// What is known of a page's texels, row by row.
struct PageState {
  TexelMask covered;
  TexelMask valid;
  std::vector<std::uint8_t> holes;      // covered, not valid
  std::vector<std::uint32_t> chartIds;  // 0: none, else chart + 1; the first where several share a texel
  std::vector<CoarseNormal> normals;    // where there are charts, for the denoiser alone
  bool hasHoles = false;
};

/// Of the covered part's middle.
CoarseNormal normalOf(TexelFootprint& footprint) {
  const Vec3 n = footprint.centroid().frame.n * kCoarseNormal;
  return {static_cast<std::int8_t>(std::lround(n.x)), static_cast<std::int8_t>(std::lround(n.y)),
          static_cast<std::int8_t>(std::lround(n.z))};
}

PageState stateOf(const BakedPage& page, const Atlas& atlas, const PageTexels& texels, bool forDenoising) {
  const std::size_t count = page.aux.pixels.size() / 4;
  PageState state;
  state.covered = state.valid = {page.aux.width, page.aux.height, std::vector<std::uint8_t>(count, 0)};
  state.holes.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const float* aux = page.aux.pixels.data() + i * 4;
    if (!(aux[0] > 0.0f)) continue;
    state.covered.known[i] = 1;
    (aux[1] < kLeastValidity ? state.holes[i] : state.valid.known[i]) = 1;
  }
  state.hasHoles = std::find(state.holes.begin(), state.holes.end(), 1) != state.holes.end();
  if (!state.hasHoles && !forDenoising) return state;
  state.chartIds.assign(count, 0);
  if (forDenoising) state.normals.assign(count, CoarseNormal{});
  parallelFor(texels.size(), kTexelsPerTask, [&](std::size_t first, std::size_t last) {
    TexelFootprint footprint;
    for (std::size_t texel = first; texel < last; ++texel) {
      const TexelCoord at = texels.coords[texel];
      const TriangleRef triangle = texels.trianglesOf(texel).front();
      const std::size_t i = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(page.aux.width) + at.x;
      state.chartIds[i] = atlas.surfaces[triangle.surface].charts[triangle.triangle] + 1;
      if (forDenoising && footprint.clip(atlas, texels, texel) > 0.0) state.normals[i] = normalOf(footprint);
    }
  });
  return state;
}

void denoisePage(BakedPage& page, const PageState& state) {
  std::vector<std::uint32_t> charts = state.chartIds;
  for (std::size_t i = 0; i < charts.size(); ++i)
    if (state.valid.known[i] == 0) charts[i] = 0;
  denoise(page.flat, page.maps, charts, state.normals, std::span(page.aux.pixels).subspan(2), 4);
}

}  // namespace

void finishPages(std::vector<BakedPage>& pages, const Atlas& atlas, const std::vector<PageTexels>& texels,
                 const FinishOptions& options) {
  for (std::size_t p = 0; p < pages.size(); ++p) {
    BakedPage& page = pages[p];
    const PageState state = stateOf(page, atlas, texels[p], options.denoise);
    if (options.denoise) denoisePage(page, state);
    parallelFor(page.maps.size() + 1, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        Image& map = i < page.maps.size() ? page.maps[i] : page.flat;
        if (state.hasHoles) fillHoles(map, state.valid, state.chartIds, state.holes);
        TexelMask known = state.covered;
        if (options.rings > 0) dilate(map, known, options.rings);
      }
    });
  }
}

void cutToHalf(BakeResult& result) {
  std::size_t cut = 0;
  float most = 0.0f;
  const auto cutImage = [&](Image& image) {
    for (float& v : image.pixels) {
      if (std::abs(v) <= kMostHalf) continue;
      ++cut;
      most = std::max(most, std::abs(v));
      v = std::copysign(kMostHalf, v);
    }
  };
  for (BakedPage& page : result.pages) {
    for (Image& map : page.maps) cutImage(map);
    cutImage(page.flat);
  }
  if (cut == 0) return;
  char text[160];
  std::snprintf(text, sizeof text,
                "%zu values are beyond 65504, the most that --half holds, and are cut to it; the greatest was %.4g",
                cut, static_cast<double>(most));
  result.stats.notes.insert(result.stats.notes.begin(), text);
}

}  // namespace lumel
