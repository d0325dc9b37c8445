#include "baker/export/directional.h"

#include <algorithm>
#include <span>

#include "baker/export/page_geometry.h"
#include "lightmap/maps/rnm_to_sh.h"

namespace lumel {
namespace {

/// Calls texel(x, y, frame) where there is a surface; the rest of the images is filled from there afterwards.
template <class Texel>
void forEachSurfaceTexel(const BakedScene& baked, std::size_t page, ChartTexels& texels, Texel&& texel) {
  const PageFrames frames = pageFrames(baked, page);
  for (int y = 0; y < texels.height; ++y)
    for (int x = 0; x < texels.width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(texels.width) + static_cast<std::size_t>(x);
      texels.kept[at] = frames.isKnown[at] != 0 && texels.charts[at] != 0;
      if (texels.kept[at] != 0) {
        texel(x, y, frames.frames[at]);
      } else {
        texels.charts[at] = 0;
        texels.weights[at] = 0.0f;
      }
    }
}

}  // namespace

std::string bandEncoding(const nlohmann::ordered_json& bakeJson, const std::string& file) {
  const std::vector<std::string> names = encodingNames(bakeJson);
  if (std::ranges::find(names, "sh1") != names.end()) return "sh1";
  if (std::ranges::find(names, "rnm") == names.end()) return {};
  const auto rnm = encodingOf(bakeJson, file, "rnm");
  return rnm && (*rnm)->conventions().at("projection") == nameOf(Projection::Raw) ? "rnm" : "";
}

std::optional<BandMaps> bandsOf(const BakedScene& baked, std::size_t page) {
  const std::vector<Image>& maps = baked.pages[page];
  BandMaps bands;
  if (baked.encoding->name() == "sh1") {
    std::copy_n(maps.begin(), 4, bands.maps.begin());
    return bands;
  }
  if (baked.encoding->name() != "rnm" || baked.encoding->conventions().at("projection") != nameOf(Projection::Raw))
    return {};
  const Image& flat = baked.flat[page];
  bands.maps.fill(Image(flat.width, flat.height, 3));
  for (int y = 0; y < flat.height; ++y)
    for (int x = 0; x < flat.width; ++x) {
      const auto sh1 = sh1FromRawRnm({maps[0].rgb(x, y), maps[1].rgb(x, y), maps[2].rgb(x, y)}, flat.rgb(x, y));
      for (std::size_t k = 0; k < 4; ++k) bands.maps[k].setRgb(x, y, sh1[k]);
    }
  return bands;
}

std::array<Image, 4> godotLayers(const BandMaps& bands, const BakedScene& baked, std::size_t page,
                                 const ChartTexels& texels) {
  std::array<Image, 4> layers;
  layers.fill(Image(texels.width, texels.height, 3, 0.5f));
  ChartTexels known = texels;
  forEachSurfaceTexel(baked, page, known, [&](int x, int y, const Frame& frame) {
    const Vec3 constant = glm::max(bands.maps[0].rgb(x, y), Vec3(0.0f));
    const Vec3 along[3] = {bands.maps[1].rgb(x, y), bands.maps[2].rgb(x, y), bands.maps[3].rgb(x, y)};
    layers[0].setRgb(x, y, constant);
    constexpr int kAxes[3] = {1, 2, 0};  // world y, z, x
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 share(0.5f);
      for (int c = 0; c < 3; ++c) {
        const Vec3 world = frame.fromLocal({along[0][c], along[1][c], along[2][c]});
        if (constant[c] > 0.0f) share[c] = std::clamp(world[kAxes[k]] / (8.0f * constant[c]) + 0.5f, 0.0f, 1.0f);
      }
      layers[k + 1].setRgb(x, y, share);
    }
  });
  const std::vector<ChartTexels> levels = mipTexels(std::move(known));
  for (Image& layer : layers) layer = mipImages(layer, levels).front();
  return layers;
}

Image unityDirections(const BandMaps& bands, const BakedScene& baked, std::size_t page, const ChartTexels& texels) {
  const auto dominant = findEncoding("dominant", {});
  Image directions(texels.width, texels.height, 4, 0.5f);
  ChartTexels known = texels;
  forEachSurfaceTexel(baked, page, known, [&](int x, int y, const Frame& frame) {
    const std::array<Vec3, 4> sh1 = {bands.maps[0].rgb(x, y), bands.maps[1].rgb(x, y), bands.maps[2].rgb(x, y),
                                     bands.maps[3].rgb(x, y)};
    std::array<Vec3, 2> maps;
    (*dominant)->derive(sh1, baked.flat[page].rgb(x, y), maps);
    const Vec3 world = frame.fromLocal(2.0f * maps[1] - 1.0f);
    const float texel[4] = {0.5f - 0.5f * world.x, 0.5f + 0.5f * world.y, 0.5f + 0.5f * world.z, maps[1].z};
    std::copy_n(texel, 4, directions.at(x, y));
  });
  return mipImages(directions, mipTexels(std::move(known))).front();
}

}  // namespace lumel
