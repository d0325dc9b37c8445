#include "lightmap/texels/texels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lightmap/raster.h"
#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr int kTile = 4;
constexpr int kBandRows = 16;  // texel rows found by one task; a multiple of kTile

std::array<std::uint32_t, 3> verticesOf(const Surface& surface, std::uint32_t triangle) {
  const std::size_t first = std::size_t{3} * triangle;
  return {surface.indices[first], surface.indices[first + 1], surface.indices[first + 2]};
}

std::array<Vec2d, 3> texelPoints(const Surface& surface, std::uint32_t triangle, const Page& page) {
  std::array<Vec2d, 3> points;
  const auto vertices = verticesOf(surface, triangle);
  for (std::size_t i = 0; i < 3; ++i)
    points[i] = snapToTexelBorder(Vec2d(surface.lightmapUvs[vertices[i]]) * Vec2d(page.width, page.height));
  return points;
}

/// The triangles that may touch each band of kBandRows rows, in order.
struct Bands {
  std::vector<std::size_t> first;  // [bands + 1] into triangles
  std::vector<TriangleRef> triangles;
};

/// Calls visit(band, triangle) for each band that each triangle's box touches.
template <class Visit>
void forEachBand(const Atlas& atlas, int pageIndex, int bandCount, Visit&& visit) {
  const Page& page = atlas.pages[static_cast<std::size_t>(pageIndex)];
  for (std::uint32_t s = 0; s < atlas.surfaces.size(); ++s) {
    const Surface& surface = atlas.surfaces[s];
    if (surface.page != pageIndex) continue;
    for (std::uint32_t t = 0; t < surface.triangleCount(); ++t) {
      const auto points = texelPoints(surface, t, page);
      const auto [low, high] = std::minmax({points[0].y, points[1].y, points[2].y});
      if (!(low < high)) continue;  // without area, or not a number
      const auto bandOf = [&](double y) {
        return static_cast<int>(std::clamp(std::floor(y / kBandRows), 0.0, bandCount - 1.0));
      };
      const int last = bandOf(high);
      for (int band = bandOf(low); band <= last; ++band) visit(static_cast<std::size_t>(band), TriangleRef{s, t});
    }
  }
}

Bands makeBands(const Atlas& atlas, int pageIndex) {
  const int height = atlas.pages[static_cast<std::size_t>(pageIndex)].height;
  const int bandCount = (height + kBandRows - 1) / kBandRows;
  Bands bands;
  bands.first.assign(static_cast<std::size_t>(bandCount) + 1, 0);
  if (bandCount == 0) return bands;
  forEachBand(atlas, pageIndex, bandCount, [&](std::size_t band, TriangleRef) { ++bands.first[band + 1]; });
  for (std::size_t i = 1; i < bands.first.size(); ++i) bands.first[i] += bands.first[i - 1];
  bands.triangles.resize(bands.first.back());
  std::vector<std::size_t> cursor(bands.first.begin(), bands.first.end() - 1);
  forEachBand(atlas, pageIndex, bandCount,
              [&](std::size_t band, TriangleRef triangle) { bands.triangles[cursor[band]++] = triangle; });
  return bands;
}

/// Texels of rows [firstRow, firstRow + kBandRows) of a page; firstTriangle counts from 0 and lacks its last entry.
PageTexels findInBand(const Atlas& atlas, const Page& page, std::span<const TriangleRef> triangles, int firstRow) {
  const int rows = std::min(kBandRows, page.height - firstRow);
  const TexelWindow window{0, firstRow, page.width, firstRow + rows};
  // Position of a texel in tile order. Tiles at the right and lower border are taken as whole ones here.
  const int tilesPerRow = (page.width + kTile - 1) / kTile;
  const auto slotOf = [&](int x, int y) {
    const int local = y - firstRow;
    const int tile = local / kTile * tilesPerRow + x / kTile;
    return static_cast<std::size_t>((tile * kTile + local % kTile) * kTile + x % kTile);
  };
  const auto forEachOverlap = [&](auto&& visit) {
    for (const TriangleRef& ref : triangles)
      forEachTexelSpan(texelPoints(atlas.surfaces[ref.surface], ref.triangle, page), window, 0.0,
                       [&](int y, int x0, int x1) {
                         for (int x = x0; x < x1; ++x) visit(slotOf(x, y), ref);
                       });
  };
  std::vector<std::uint32_t> cursor(static_cast<std::size_t>(tilesPerRow) * kTile * kBandRows, 0);
  forEachOverlap([&](std::size_t slot, const TriangleRef&) { ++cursor[slot]; });

  PageTexels found;
  std::uint32_t total = 0;
  for (std::size_t slot = 0; slot < cursor.size(); ++slot) {
    const std::uint32_t count = cursor[slot];
    cursor[slot] = total;
    if (count == 0) continue;
    const std::size_t tile = slot / (kTile * kTile);
    const auto tiles = static_cast<std::size_t>(tilesPerRow);
    const std::size_t x = tile % tiles * kTile + slot % kTile;
    const std::size_t y = static_cast<std::size_t>(firstRow) + tile / tiles * kTile + slot / kTile % kTile;
    found.coords.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)});
    found.firstTriangle.push_back(total);
    total += count;
  }
  found.triangles.resize(total);
  forEachOverlap([&](std::size_t slot, const TriangleRef& ref) { found.triangles[cursor[slot]++] = ref; });
  return found;
}

PageTexels findOnPage(const Atlas& atlas, int pageIndex) {
  const Page& page = atlas.pages[static_cast<std::size_t>(pageIndex)];
  LUMEL_CHECK(page.width >= 0 && page.width <= 65536 && page.height >= 0 && page.height <= 65536);
  const Bands bands = makeBands(atlas, pageIndex);
  const std::size_t bandCount = bands.first.size() - 1;
  std::vector<PageTexels> parts(bandCount);
  parallelFor(bandCount, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t band = first; band < last; ++band) {
      const auto triangles =
          std::span(bands.triangles).subspan(bands.first[band], bands.first[band + 1] - bands.first[band]);
      parts[band] = findInBand(atlas, page, triangles, static_cast<int>(band) * kBandRows);
    }
  });

  PageTexels all;
  all.width = page.width;
  all.height = page.height;
  std::size_t texels = 0;
  std::size_t overlaps = 0;
  for (const PageTexels& part : parts) {
    texels += part.coords.size();
    overlaps += part.triangles.size();
  }
  LUMEL_CHECK(overlaps <= std::numeric_limits<std::uint32_t>::max());
  all.coords.reserve(texels);
  all.firstTriangle.reserve(texels + 1);
  all.triangles.reserve(overlaps);
  for (PageTexels& part : parts) {
    const auto offset = static_cast<std::uint32_t>(all.triangles.size());
    for (const std::uint32_t first : part.firstTriangle) all.firstTriangle.push_back(offset + first);
    all.coords.insert(all.coords.end(), part.coords.begin(), part.coords.end());
    all.triangles.insert(all.triangles.end(), part.triangles.begin(), part.triangles.end());
    part = {};
  }
  all.firstTriangle.push_back(static_cast<std::uint32_t>(all.triangles.size()));
  return all;
}

}  // namespace

std::vector<PageTexels> findTexels(const Atlas& atlas) {
  std::vector<PageTexels> pages;
  for (std::size_t i = 0; i < atlas.pages.size(); ++i) pages.push_back(findOnPage(atlas, static_cast<int>(i)));
  return pages;
}

}  // namespace lumel
