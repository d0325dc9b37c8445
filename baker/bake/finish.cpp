#include "baker/bake/finish.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

#include "baker/path/texel_sums.h"
#include "lightmap/maps/denoise.h"
#include "lightmap/maps/dilate.h"
#include "scene/base/half.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr std::size_t kTexelsPerTask = 1024;

/// What is known of a page's texels, row by row.
struct PageState {
  TexelMask valid;
  std::vector<std::uint8_t> holes;      // covered, not valid
  std::vector<std::uint32_t> chartIds;  // 0: none, else chart + 1; the first where several share a texel
  std::vector<CoarseNormal> normals;    // where there are charts, for the denoiser alone
  bool hasHoles = false;
};

CoarseNormal coarse(const Vec3& normal) {
  const Vec3 n = normal * kCoarseNormal;
  return {static_cast<std::int8_t>(std::lround(n.x)), static_cast<std::int8_t>(std::lround(n.y)),
          static_cast<std::int8_t>(std::lround(n.z))};
}

PageState stateOf(const BakedPage& page, const Atlas& atlas, const PageTexels& texels, bool forDenoising) {
  const std::size_t count = page.aux.pixels.size() / 4;
  PageState state;
  state.valid = {page.aux.width, page.aux.height, std::vector<std::uint8_t>(count, 0)};
  state.holes.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const float* aux = page.aux.pixels.data() + i * 4;
    if (!(aux[0] > 0.0f)) continue;
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
      if (forDenoising && footprint.clip(atlas, texels, texel) > 0.0)
        state.normals[i] = coarse(footprint.centroid().frame.n);
    }
  });
  return state;
}

constexpr std::size_t kErrorChannel = 2;

/// Where a page keeps the errors of its maps, the flat one first.
std::vector<ErrorPlane> errorsOf(BakedPage& page) {
  std::vector<ErrorPlane> planes{{page.aux.pixels.data() + kErrorChannel, 4}};
  const std::size_t maps = page.maps.size();
  for (std::size_t k = 0; k < maps; ++k) planes.push_back({page.mapErrors.pixels.data() + k, maps});
  return planes;
}

/// The mean of the standard errors of covered texels around one.
float errorAround(const Image& aux, const ErrorPlane& errors, std::uint32_t texel) {
  const int x = static_cast<int>(texel) % aux.width, y = static_cast<int>(texel) / aux.width;
  float sum = 0.0f, count = 0.0f;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, aux.height - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, aux.width - 1); ++u) {
      const float error = errors[static_cast<std::size_t>(v) * static_cast<std::size_t>(aux.width) + u];
      if (!(aux.at(u, v)[0] > 0.0f) || !std::isfinite(error)) continue;
      sum += error;
      count += 1.0f;
    }
  return count > 0.0f ? sum / count : std::numeric_limits<float>::quiet_NaN();
}

/// Makes texels beyond seams part of their charts while noise is taken out: they hold what continues these.
void addBeyond(const Seams& seams, std::span<const BeyondTexel> beyond, std::vector<std::uint32_t>& charts,
               PageState& state) {
  for (const BeyondTexel& texel : beyond) {
    if (charts[texel.texel] != 0) continue;
    const SeamSide& side = seams.pairs[texel.pair].sides[texel.side];
    charts[texel.texel] = side.chart + 1;
    state.normals[texel.texel] = coarse(side.frame.n);
  }
}

void denoisePage(BakedPage& page, PageState& state, const Seams& seams, std::span<const BeyondTexel> beyond,
                 std::size_t judges) {
  std::vector<std::uint32_t> charts = state.chartIds;
  for (std::size_t i = 0; i < charts.size(); ++i)
    if (state.valid.known[i] == 0) charts[i] = 0;
  addBeyond(seams, beyond, charts, state);
  denoise(page.flat, page.maps, charts, state.normals, errorsOf(page), judges);
}

/// Calls grow(image) for the maps' errors, a channel for each.
template <class Grow>
void growErrors(BakedPage& page, const Grow& grow) {
  const std::vector<ErrorPlane> planes = errorsOf(page);
  Image errors(page.aux.width, page.aux.height, static_cast<int>(planes.size()));
  const std::size_t count = page.aux.pixels.size() / 4;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t m = 0; m < planes.size(); ++m) errors.pixels[i * planes.size() + m] = planes[m][i];
  grow(errors);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t m = 0; m < planes.size(); ++m) planes[m][i] = errors.pixels[i * planes.size() + m];
}

/// The maps of one group, with a flat map that they share with it or have for themselves.
std::vector<SeamPage> seamPagesOf(std::vector<BakedPage>& pages, const MapGroup& group, std::vector<Image>& ownFlat) {
  std::vector<SeamPage> seamPages;
  for (std::size_t p = 0; p < pages.size(); ++p) {
    BakedPage& page = pages[p];
    SeamPage& to = seamPages.emplace_back();
    to.flat = ownFlat.empty() ? &page.flat : &ownFlat[p];
    to.maps = std::span(page.maps).subspan(group.first, group.count);
    to.states.assign(page.aux.pixels.size() / 4, TexelState::Empty);
    for (std::size_t i = 0; i < to.states.size(); ++i)
      if (page.aux.pixels[i * 4] > 0.0f)
        to.states[i] = page.aux.pixels[i * 4 + 1] < kLeastValidity ? TexelState::Hole : TexelState::Known;
    to.errors = std::span(page.aux.pixels).subspan(std::min(kErrorChannel, page.aux.pixels.size()));
    to.coverages = page.aux.pixels;
    to.stride = 4;
    to.isSigned = group.isSigned;
  }
  return seamPages;
}

/// The entries of one page; they are sorted by page.
std::span<const BeyondTexel> onPage(const std::vector<BeyondTexel>& beyond, std::size_t page) {
  const auto [first, last] = std::ranges::equal_range(beyond, page, {}, &BeyondTexel::page);
  return {first, last};
}

/// Seams in all groups of maps. Each is mended beside the flat map as it was, so that the result of one does not depend
/// on others; the page keeps the flat map of the first.
class SeamMending {
 public:
  SeamMending(const Seams& seams, std::vector<BakedPage>& pages, const std::vector<MapGroup>& groups)
      : seams_(seams), pages_(pages), groups_(groups) {
    mends_ = !seams.points.empty() && std::ranges::all_of(groups, [](const MapGroup& g) { return canMend(g.count); });
  }

  /// Sorted by page; empty where nothing is mended.
  const std::vector<BeyondTexel>& beyond() const { return beyond_; }

  void continueAll() {
    if (!mends_) return;
    std::vector<Image> flat = flatMaps();
    forEachGroup(flat, [&](std::vector<SeamPage>& seamPages) {
      if (beyond_.empty()) beyond_ = texelsBeyond(seams_, seamPages);
      continueLight(seams_, beyond_, seamPages);
    });
    for (const BeyondTexel& texel : beyond_)
      for (const ErrorPlane& plane : errorsOf(pages_[texel.page]))
        plane[texel.texel] = errorAround(pages_[texel.page].aux, plane, texel.texel);
  }

  SeamFigures mendAll() {
    SeamFigures figures;
    if (!mends_) return figures;
    std::vector<Image> flat = flatMaps();
    forEachGroup(flat, [&](std::vector<SeamPage>& seamPages) {
      for (const BeyondTexel& texel : beyond_) seamPages[texel.page].states[texel.texel] = TexelState::Beyond;
      const SeamFigures own = mendSeams(seams_, beyond_, seamPages);
      if (figures.points == 0) figures = own;
    });
    return figures;
  }

 private:
  std::vector<Image> flatMaps() const {
    std::vector<Image> flat;
    if (groups_.size() > 1)
      for (const BakedPage& page : pages_) flat.push_back(page.flat);
    return flat;
  }
  template <class Mend>
  void forEachGroup(const std::vector<Image>& flat, const Mend& mend) {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      std::vector<Image> own = g == 0 ? std::vector<Image>() : flat;
      std::vector<SeamPage> seamPages = seamPagesOf(pages_, groups_[g], own);
      mend(seamPages);
    }
  }

  const Seams& seams_;
  std::vector<BakedPage>& pages_;
  const std::vector<MapGroup>& groups_;
  std::vector<BeyondTexel> beyond_;
  bool mends_ = false;
};

/// Calls map(image) for each map of a page, in parallel.
template <class Map>
void forEachMap(BakedPage& page, const Map& map) {
  parallelFor(page.maps.size() + 1, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) map(i < page.maps.size() ? page.maps[i] : page.flat);
  });
}

void dilatePage(BakedPage& page, std::span<const BeyondTexel> beyond, int rings) {
  TexelMask known{page.aux.width, page.aux.height, std::vector<std::uint8_t>(page.aux.pixels.size() / 4, 0)};
  for (std::size_t i = 0; i < known.known.size(); ++i) known.known[i] = page.aux.pixels[i * 4] > 0.0f ? 1 : 0;
  for (const BeyondTexel& texel : beyond) known.known[texel.texel] = 1;
  forEachMap(page, [&](Image& map) {
    TexelMask mask = known;
    dilate(map, mask, rings);
  });
  growErrors(page, [&](Image& errors) { dilate(errors, known, rings); });
}

/// A page's maps of one encoding.
std::vector<Image> storedMaps(const BakedPage& page, const StoredEncoding& stored) {
  const Encoding& encoding = *stored.encoding;
  const auto from = page.maps.begin() + static_cast<std::ptrdiff_t>(stored.first);
  if (!encoding.source() && encoding.mapNames().front() != kFlatMap)
    return {from, from + static_cast<std::ptrdiff_t>(encoding.mapCount())};
  std::vector<Image> images(encoding.mapCount(), Image(page.flat.width, page.flat.height, 3));
  const std::size_t sampledCount = page.maps.size() - stored.first;
  parallelFor(static_cast<std::size_t>(page.flat.height), 16, [&](std::size_t firstRow, std::size_t lastRow) {
    std::array<Vec3, kMostMaps> sampled{}, maps{};
    for (int y = static_cast<int>(firstRow); y < static_cast<int>(lastRow); ++y)
      for (int x = 0; x < page.flat.width; ++x) {
        for (std::size_t k = 0; k < sampledCount; ++k) sampled[k] = from[static_cast<std::ptrdiff_t>(k)].rgb(x, y);
        encoding.derive(std::span(sampled).first(sampledCount), page.flat.rgb(x, y),
                        std::span(maps).first(images.size()));
        for (std::size_t k = 0; k < images.size(); ++k) images[k].setRgb(x, y, maps[k]);
      }
  });
  return images;
}

}  // namespace

SeamFigures finishPages(std::vector<BakedPage>& pages, const Atlas& atlas, const std::vector<PageTexels>& texels,
                        const FinishOptions& options) {
  static const Seams kNoSeams;
  const Seams& seams = options.seams != nullptr && options.rings > 0 ? *options.seams : kNoSeams;
  const std::size_t maps = pages.empty() ? 0 : pages.front().maps.size();
  const std::vector<MapGroup> groups = options.groups.empty() ? std::vector<MapGroup>{{0, maps}} : options.groups;
  SeamMending mending(seams, pages, groups);
  mending.continueAll();
  for (std::size_t p = 0; p < pages.size(); ++p) {
    PageState state = stateOf(pages[p], atlas, texels[p], options.denoise);
    if (options.denoise) denoisePage(pages[p], state, seams, onPage(mending.beyond(), p), groups.front().count);
    if (state.hasHoles) {
      const auto fill = [&](Image& map) { fillHoles(map, state.valid, state.chartIds, state.holes); };
      forEachMap(pages[p], fill);
      growErrors(pages[p], fill);
    }
  }
  const SeamFigures figures = mending.mendAll();
  if (options.rings > 0)
    for (std::size_t p = 0; p < pages.size(); ++p) dilatePage(pages[p], onPage(mending.beyond(), p), options.rings);
  return figures;
}

void encodePages(std::vector<BakedPage>& pages, const Encoding& encoding) {
  const std::vector<StoredEncoding> all = encoding.stored();
  for (BakedPage& page : pages) {
    std::vector<Image> images;
    for (const StoredEncoding& stored : all) {
      std::vector<Image> own = storedMaps(page, stored);
      for (std::size_t k = 0; k < own.size(); ++k)
        if (stored.encoding->mapNames()[k] != kFlatMap) images.push_back(std::move(own[k]));
    }
    page.maps = std::move(images);
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
