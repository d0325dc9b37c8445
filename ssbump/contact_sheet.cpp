#include "ssbump/contact_sheet.h"

#include <algorithm>
#include <functional>

namespace lumel::ssbump {
namespace {

constexpr int kGap = 6;

Image panel(const Image& source, int side, const Progress& progress, const std::function<Vec3(int, int)>& color) {
  Image full(source.width, source.height, 3);
  for (int y = 0; y < full.height && !progress.cancelled(); ++y)
    for (int x = 0; x < full.width; ++x) full.setRgb(x, y, color(x, y));
  while (full.width > side) full = halve(full, MipFilter::Box, true, progress);
  return full;
}

}  // namespace

Image panelGrid(std::span<const Image> panels, int columns) {
  if (panels.empty()) return {};
  const int w = panels[0].width, h = panels[0].height;
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  Image grid(columns * (w + kGap) + kGap, rows * (h + kGap) + kGap, 3, 0.25f);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const int x0 = kGap + static_cast<int>(i) % columns * (w + kGap),
              y0 = kGap + static_cast<int>(i) / columns * (h + kGap);
    for (int y = 0; y < h; ++y) std::copy_n(panels[i].at(0, y), w * 3, grid.at(x0, y0 + y));
  }
  return grid;
}

Expected<void> writeContactSheet(const std::filesystem::path& input, const BakeSettings& settings, int side,
                                 const std::filesystem::path& output, Progress& progress) {
  auto lobes = rnmLobes(settings.maps.lobe, settings.maps.coneOpeningDegrees);
  lobes.push_back(ambientLobe());
  auto baked = bakeInMemory(input, settings, lobes, progress);
  if (!baked) return baked.error();
  const Image &normals = baked->normals, &o = baked->occlusion;
  const HeightField& field = baked->field;
  const float span = std::max(field.highest - field.lowest, 1e-6f);
  const auto s = [&](int x, int y) { return normalWeights(normals.rgb(x, y)) * o.rgb(x, y); };
  const Vec3 right = glm::normalize(Vec3(1, 0, 0.5f)), top = glm::normalize(Vec3(0, 1, 0.5f));
  const std::vector<Image> panels{
      panel(o, side, progress, [&](int x, int y) { return Vec3((field.row(y)[x] - field.lowest) / span); }),
      panel(o, side, progress, [&](int x, int y) { return encodeNormal(normals.rgb(x, y), Green::Up); }),
      panel(o, side, progress, [&](int x, int y) { return normalWeights(normals.rgb(x, y)) * 1.5f; }),
      panel(o, side, progress, [&](int x, int y) { return s(x, y) * 1.5f; }),
      panel(o, side, progress, [&](int x, int y) { return encodeNormal(recoveredNormal(s(x, y)), Green::Up); }),
      panel(o, side, progress, [&](int x, int y) { return Vec3(o.at(x, y)[3]); }),
      panel(o, side, progress, [&](int x, int y) { return Vec3(litBy(s(x, y), right)); }),
      panel(o, side, progress, [&](int x, int y) { return Vec3(litBy(s(x, y), top)); }),
  };
  return writeImage(output, panelGrid(panels, 4), {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}},
                    progress);
}

}  // namespace lumel::ssbump
