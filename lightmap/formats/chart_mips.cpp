#include "lightmap/formats/chart_mips.h"

#include <algorithm>
#include <array>

#include "lightmap/maps/dilate.h"

namespace lumel {
namespace {

std::size_t indexOf(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

/// Calls visit(index) for the texels of the finer level under one of the coarser. With an odd number of columns or rows
/// the last coarse texel has three of them.
template <class Visit>
void forEachChild(const ChartTexels& fine, const ChartTexels& coarse, int x, int y, Visit&& visit) {
  const int lastX = x + 1 == coarse.width ? fine.width : 2 * x + 2;
  const int lastY = y + 1 == coarse.height ? fine.height : 2 * y + 2;
  for (int cy = 2 * y; cy < lastY; ++cy)
    for (int cx = 2 * x; cx < lastX; ++cx) visit(indexOf(fine.width, cx, cy));
}

/// The chart with the most surface under a coarse texel, the first met where two have the same; 0: none.
struct Owner {
  std::uint32_t chart = 0;
  float weight = 0.0f;
  int children = 0;
};
Owner ownerOf(const ChartTexels& fine, const ChartTexels& coarse, int x, int y) {
  std::array<Owner, 9> owners{};
  int children = 0;
  forEachChild(fine, coarse, x, y, [&](std::size_t i) {
    ++children;
    if (!(fine.weights[i] > 0.0f)) return;
    Owner* owner = owners.data();
    while (owner->chart != 0 && owner->chart != fine.charts[i]) ++owner;
    owner->chart = fine.charts[i];
    owner->weight += fine.weights[i];
  });
  Owner most = *std::max_element(owners.begin(), owners.end(),
                                 [](const Owner& a, const Owner& b) { return a.weight < b.weight; });
  most.children = children;
  return most;
}

ChartTexels coarserOf(const ChartTexels& fine) {
  ChartTexels coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}, {}, {}};
  const std::size_t count = static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height);
  coarse.charts.resize(count);
  coarse.weights.resize(count);
  coarse.kept.assign(count, 0);
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x) {
      const std::size_t at = indexOf(coarse.width, x, y);
      const Owner owner = ownerOf(fine, coarse, x, y);
      coarse.charts[at] = owner.chart;
      coarse.weights[at] = owner.weight / static_cast<float>(owner.children);
      coarse.kept[at] = owner.chart != 0;
    }
  return coarse;
}

Image coarserImage(const Image& map, const ChartTexels& fine, const ChartTexels& coarse) {
  Image image(coarse.width, coarse.height, map.channels);
  const auto channels = static_cast<std::size_t>(map.channels);
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x) {
      const std::uint32_t chart = coarse.charts[indexOf(coarse.width, x, y)];
      if (chart == 0) continue;
      double total = 0.0;
      std::array<double, 4> sums{};
      forEachChild(fine, coarse, x, y, [&](std::size_t i) {
        if (fine.charts[i] != chart || !(fine.weights[i] > 0.0f)) return;
        total += static_cast<double>(fine.weights[i]);
        for (std::size_t c = 0; c < channels; ++c)
          sums[c] += static_cast<double>(fine.weights[i]) * static_cast<double>(map.pixels[i * channels + c]);
      });
      for (std::size_t c = 0; c < channels; ++c) image.at(x, y)[c] = static_cast<float>(sums[c] / total);
    }
  return image;
}

/// Fills texels that are not kept: one ring from their neighbours, which bilinear lookups read, the rest from the
/// coarser level, which is full.
void fill(Image& image, const ChartTexels& level, const Image* coarser) {
  TexelMask mask{image.width, image.height, level.kept};
  dilate(image, mask, 1);
  if (!coarser) return;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (mask.known[indexOf(image.width, x, y)] != 0) continue;
      const float* from = coarser->at(std::min(x / 2, coarser->width - 1), std::min(y / 2, coarser->height - 1));
      std::copy_n(from, image.channels, image.at(x, y));
    }
}

}  // namespace

std::vector<ChartTexels> mipTexels(ChartTexels page) {
  std::vector<ChartTexels> levels;
  levels.push_back(std::move(page));
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(coarserOf(levels.back()));
  return levels;
}

std::vector<Image> mipImages(const Image& map, std::span<const ChartTexels> levels) {
  std::vector<Image> images = {map};
  for (std::size_t i = 1; i < levels.size(); ++i)
    images.push_back(coarserImage(images.back(), levels[i - 1], levels[i]));
  for (std::size_t i = images.size(); i-- > 0;)
    fill(images[i], levels[i], i + 1 < images.size() ? &images[i + 1] : nullptr);
  return images;
}

}  // namespace lumel
