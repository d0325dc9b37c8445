#include "ssbump/bake.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/base/check.h"
#include "scene/base/parallel.h"
#include "scene/base/stopwatch.h"
#include "ssbump/occlusion/bilateral.h"

namespace lumel::ssbump {
namespace {

// About 200 bytes per texel of triangles and tree: 3.3 GB.
constexpr std::size_t kMostRayTexels = 4096 * 4096;

/// The alpha channel of a file, unless it is the one that holds the heights.
Image alphaPlane(const LoadedImage& loaded, int heightChannel) {
  const Image& image = loaded.image;
  for (std::size_t i = 0; i < loaded.channelNames.size(); ++i) {
    if (loaded.channelNames[i] != "A" || static_cast<int>(i) == heightChannel) continue;
    Image plane(image.width, image.height, 1);
    for (std::size_t p = 0; p < plane.pixels.size(); ++p)
      plane.pixels[p] = image.pixels[p * static_cast<std::size_t>(image.channels) + i];
    return plane;
  }
  return {};
}

Expected<Image> readNormalMap(const std::filesystem::path& file, int width, int height, const Progress& progress) {
  auto loaded = readImage(file, progress);
  if (!loaded) return loaded.error();
  const Image& image = loaded->image;
  if (image.channels < 3)
    return inputError(file.string() + ": a normal map has three channels, this has " + std::to_string(image.channels));
  if (image.width != width || image.height != height)
    return inputError(file.string() + ": the normal map is " + std::to_string(image.width) + "x" +
                      std::to_string(image.height) + ", the height map " + std::to_string(width) + "x" +
                      std::to_string(height) + "; make them the same size");
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (!std::isfinite(image.pixels[i]))
      return inputError(file.string() + ": holds a value that is not a finite number");
  return std::move(loaded->image);
}

struct Inputs {
  HeightField field;
  Image alpha, normalMap;
};

Expected<Inputs> readInputs(const std::filesystem::path& input, const BakeSettings& settings, Progress& progress) {
  auto loaded = readImage(input, progress);
  if (!loaded) return loaded.error();
  Inputs inputs;
  const double bits = loaded->isFloat ? 0 : loaded->bitsPerChannel;
  if (auto channel = findChannel(*loaded, settings.height.channel, input.string()))
    inputs.alpha = alphaPlane(*loaded, *channel);
  auto field = heightFieldFromImage(std::move(*loaded), settings.height, input.string());
  if (!field) return field.error();
  inputs.field = std::move(*field);
  if (settings.bilateralRadius > 0) {
    float threshold = settings.bilateralThresholdTexels;
    if (threshold <= 0) {
      if (bits == 0) return usageError("--bilateral on a float map needs --bilateral-threshold (in texels of height)");
      const double scale =
          settings.height.scaleIsPercent ? settings.height.scale / 100 * inputs.field.width : settings.height.scale;
      const double step = std::abs(scale) / (std::exp2(bits) - 1);
      threshold = static_cast<float>(step * std::max(2, settings.bilateralRadius));
    }
    progress.begin("filter", static_cast<std::uint64_t>(inputs.field.height));
    bilateralFilter(inputs.field, settings.bilateralRadius, threshold, progress);
    progress.end();
    if (progress.cancelled()) return interrupted();
  }
  if (!settings.normalMap.empty()) {
    auto normals = readNormalMap(settings.normalMap, inputs.field.width, inputs.field.height, progress);
    if (!normals) return normals.error();
    inputs.normalMap = std::move(*normals);
  }
  return inputs;
}

Image bandNormals(const Inputs& inputs, Green green, int firstRow, int rows) {
  Image normals(inputs.field.width, rows, 3);
  parallelFor(static_cast<std::size_t>(rows), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r) {
      const int y = static_cast<int>(r);
      for (int x = 0; x < normals.width; ++x)
        normals.setRgb(x, y,
                       inputs.normalMap.empty() ? heightNormal(inputs.field, x, firstRow + y)
                                                : decodeNormal(inputs.normalMap.rgb(x, firstRow + y), green));
    }
  });
  return normals;
}

/// How the slopes of a given normal map and of the heights go together, from -1 to 1, along x and y. Maps of one
/// surface agree however smooth or steep one of them is.
Vec2 slopeAgreement(const Inputs& inputs, Green green) {
  constexpr int kMostSamples = 256;  // on a side
  const int width = inputs.field.width, height = inputs.field.height;
  const int stepX = (width + kMostSamples - 1) / kMostSamples, stepY = (height + kMostSamples - 1) / kMostSamples;
  Vec2d product(0), given(0), derived(0);
  for (int y = 0; y < height; y += stepY)
    for (int x = 0; x < width; x += stepX) {
      const Vec2d a(Vec2(decodeNormal(inputs.normalMap.rgb(x, y), green)));
      const Vec2d b(Vec2(heightNormal(inputs.field, x, y)));
      product += a * b;
      given += a * a;
      derived += b * b;
    }
  return Vec2(product / glm::max(glm::sqrt(given * derived), Vec2d(1e-30)));
}

/// What is likely wrong with a normal map that leans against the heights; empty where nothing is.
std::string slopeWarning(const Inputs& inputs, const BakeSettings& settings) {
  if (inputs.normalMap.empty()) return {};
  constexpr float kAgainst = -0.3f;  // met by 10 of 11 real maps with green the other way, by none the right way
  const Vec2 agreement = slopeAgreement(inputs, settings.normalMapGreen);
  const std::string text = settings.normalMap.string() + ": leans against the heights ";
  if (agreement.x < kAgainst && agreement.y < kAgainst)
    return text + "both ways; if dark is high in the height map, " + (settings.height.invert ? "leave out" : "give") +
           " --invert";
  if (agreement.y < kAgainst)
    return text + "along y alone; if its green runs the other way, give --green " +
           (settings.normalMapGreen == Green::Up ? "down" : "up");
  return {};
}

void copyInto(Image& band, int x0, const Image& tile) {
  for (int y = 0; y < tile.height; ++y)
    std::copy_n(tile.at(0, y), static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.channels),
                band.at(x0, y));
}

std::map<std::string, std::string> describe(const BakeSettings& s, const HeightField& field, int reach) {
  std::map<std::string, std::string> m;
  m["lumel:height"] = std::to_string(field.lowest) + " to " + std::to_string(field.highest) + " texels";
  m["lumel:wrap"] = field.wrap ? "yes" : "no";
  m["lumel:lobe"] = s.maps.lobe == LobeShape::Hemisphere
                        ? "hemisphere"
                        : "cone of " + std::to_string(s.maps.coneOpeningDegrees) + " degrees";
  const int azimuths = s.horizon.azimuths > 0 ? s.horizon.azimuths : automaticAzimuths(field);
  m["lumel:occlusion"] = s.backEnd == BackEnd::Horizon ? "horizons, " + std::to_string(azimuths) + " azimuths"
                                                       : "rays, " + std::to_string(s.rays.count) + " per texel";
  m["lumel:reach"] = std::to_string(reach) + " texels";
  return m;
}

/// Either back end behind one call.
class Occluder {
 public:
  static Expected<Occluder> prepare(const HeightField& field, const BakeSettings& settings, const Progress& progress) {
    Occluder self;
    if (settings.backEnd == BackEnd::Horizon) {
      self.horizon_.emplace(field, settings.horizon);
      return self;
    }
    if (field.texels.size() > kMostRayTexels)
      return usageError(
          "--method rays holds the triangles of the whole map, about 200 bytes per texel, and stops at "
          "4096x4096; use --method horizon, which runs in tiles");
    auto built = RayOcclusion::build(field, settings.rays, progress);
    if (!built) return built.error();
    self.rays_.emplace(std::move(*built));
    return self;
  }

  Image occlusion(const TexelRect& rect, std::span<const Lobe> lobes, Progress& progress) const {
    return horizon_ ? horizon_->occlusion(rect, lobes, progress) : rays_->occlusion(rect, lobes, progress);
  }

 private:
  std::optional<Horizon> horizon_;
  std::optional<RayOcclusion> rays_;
};

/// Rows [y, y + rows) tile by tile. Errors: Interrupted.
Expected<Image> bandOcclusion(const Occluder& occluder, const BakeSettings& settings, int width, int y, int rows,
                              std::span<const Lobe> lobes, Progress& progress) {
  Image band(width, rows, static_cast<int>(lobes.size()));
  for (int x = 0; x < width; x += settings.tileWidth) {
    const TexelRect rect{x, y, std::min(settings.tileWidth, width - x), rows};
    Image tile = occluder.occlusion(rect, lobes, progress);
    if (progress.cancelled()) return interrupted();
    if (rect.width == width) return tile;
    copyInto(band, x, tile);
  }
  return band;
}

}  // namespace

Expected<BakedInMemory> bakeInMemory(const std::filesystem::path& input, const BakeSettings& settings,
                                     std::span<const Lobe> lobes, Progress& progress) {
  auto inputs = readInputs(input, settings, progress);
  if (!inputs) return inputs.error();
  auto occluder = Occluder::prepare(inputs->field, settings, progress);
  if (!occluder) return occluder.error();
  const int height = inputs->field.height;
  progress.begin("ssbump", inputs->field.texels.size());
  auto occlusion = bandOcclusion(*occluder, settings, inputs->field.width, 0, height, lobes, progress);
  progress.end();
  if (!occlusion) return occlusion.error();
  Image normals = bandNormals(*inputs, settings.normalMapGreen, 0, height);
  return BakedInMemory{std::move(inputs->field), std::move(normals), std::move(*occlusion)};
}

Expected<BakeReport> bakeHeightMap(const std::filesystem::path& input, const BakeSettings& settings,
                                   Progress& progress) {
  LUMEL_CHECK(settings.tileHeight % 2 == 0 && settings.tileWidth > 0);
  const Stopwatch sinceStart;
  auto inputs = readInputs(input, settings, progress);
  if (!inputs) return inputs.error();
  const HeightField& field = inputs->field;
  BakeReport report;
  report.width = field.width;
  report.height = field.height;
  report.lowestTexels = field.lowest;
  report.highestTexels = field.highest;
  const int wanted = settings.backEnd == BackEnd::Horizon ? settings.horizon.reach : settings.rays.reach;
  report.reachTexels = wanted > 0 ? wanted : automaticReach(field);

  auto occluder = Occluder::prepare(field, settings, progress);
  if (!occluder) return occluder.error();
  auto maps = MapSet::open(settings.maps, field.width, field.height, std::move(inputs->alpha),
                           describe(settings, field, report.reachTexels), progress);
  if (!maps) return maps.error();
  report.prepareSeconds = sinceStart.seconds();

  progress.begin("ssbump", field.texels.size());
  for (int y = 0; y < field.height; y += settings.tileHeight) {
    const int rows = std::min(settings.tileHeight, field.height - y);
    const Stopwatch occlusionTime;
    auto occlusion = bandOcclusion(*occluder, settings, field.width, y, rows, maps->lobes(), progress);
    if (!occlusion) return occlusion.error();
    report.occlusionSeconds += occlusionTime.seconds();
    if (auto done = maps->write(bandNormals(*inputs, settings.normalMapGreen, y, rows), *occlusion, progress); !done)
      return done.error();
  }
  progress.end();
  if (auto done = maps->commit(progress); !done) return done.error();
  report.warnings = maps->warnings();
  if (std::string warning = slopeWarning(*inputs, settings); !warning.empty())
    report.warnings.push_back(std::move(warning));
  if (field.lowest == field.highest)
    report.warnings.push_back(input.string() + ": every height is the same: the result is flat");
  return report;
}

}  // namespace lumel::ssbump
