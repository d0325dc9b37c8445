#include "baker/export/map_export.h"

#include <algorithm>
#include <cmath>

#include "baker/files/names/conventions.h"
#include "baker/files/names/file_names.h"
#include "baker/files/names/version.h"
#include "lightmap/formats/rgbm.h"
#include "lightmap/formats/texture_files.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

/// What texels that no surface needs count in a block beside others.
constexpr float kFilledWeight = 1.0f / 64.0f;

bool isTexture(MapContainer container) { return container == MapContainer::Ktx2 || container == MapContainer::Dds; }

const char* extensionOf(MapContainer container) {
  switch (container) {
    case MapContainer::ExrHalf:
      return ".exr";
    case MapContainer::PngRgbm:
      return ".png";
    case MapContainer::Ktx2:
      return ".ktx2";
    case MapContainer::Dds:
      return ".dds";
  }
  return "";
}

/// A map of a page, and whether its values may be negative.
struct PageMap {
  std::string name;
  const Image* image;
  bool isSigned;
};

std::vector<PageMap> mapsOf(const BakedScene& baked, std::size_t page, bool flatAlone) {
  std::vector<PageMap> maps;
  const std::vector<std::string>& names = baked.encoding->mapNames();
  for (std::size_t k = 0; k < names.size() && !flatAlone; ++k)
    if (names[k] != kFlatMap) maps.push_back({names[k], &baked.pages[page][k], baked.encoding->isSigned()});
  maps.push_back({kFlatMap, &baked.flat[page], false});
  return maps;
}

float largestValue(const BakedScene& baked, bool flatAlone) {
  float most = 0.0f;
  for (std::size_t page = 0; page < baked.flat.size(); ++page)
    for (const PageMap& map : mapsOf(baked, page, flatAlone))
      most = std::max(most, *std::max_element(map.image->pixels.begin(), map.image->pixels.end()));
  return most;
}

/// How far what was written is from the bake, over texels with a surface.
Json differenceOf(const Image& written, const Image& map, const Image& flat, const ChartTexels& texels) {
  double squares = 0, sum = 0, reference = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < texels.weights.size(); ++i) {
    if (!(texels.weights[i] > 0.0f)) continue;
    ++count;
    for (std::size_t c = 0; c < 3; ++c) {
      const double difference =
          static_cast<double>(written.pixels[3 * i + c]) - static_cast<double>(map.pixels[3 * i + c]);
      squares += difference * difference;
      sum += difference;
      reference += static_cast<double>(flat.pixels[3 * i + c]);
    }
  }
  if (count == 0 || !(reference > 0)) return {{"relativeRmse", nullptr}, {"relativeBias", nullptr}};
  const double mean = reference / (3.0 * static_cast<double>(count));
  return {{"relativeRmse", std::sqrt(squares / (3.0 * static_cast<double>(count))) / mean},
          {"relativeBias", sum / reference}};
}

std::map<std::string, std::string> metadataOf(const BakedScene& baked, const std::string& map) {
  std::map<std::string, std::string> metadata = {
      {"KTXwriter", std::string("lumel ") + kVersion}, {"lumel:encoding", baked.encoding->name()}, {"lumel:map", map}};
  for (const auto& [key, text] : describeConventions(*baked.encoding)) metadata["lumel:" + key] = text;
  return metadata;
}

/// One run of an export: options resolved, and where files go.
class MapWriter {
 public:
  MapWriter(const BakedScene& baked, const MapExportOptions& options, ExportFolder& folder)
      : baked_(baked), options_(options), folder_(folder) {
    range_ = options.rgbmRange.value_or(largestValue(baked, options.flatAlone));
    if (!(range_ > 0.0f)) range_ = 1.0f;
  }

  Expected<Json> write(std::size_t page, const PageMap& map, std::span<const ChartTexels> levels) {
    std::string name = pageFileName(page, map.name);
    name.replace(name.rfind('.'), std::string::npos, extensionOf(options_.container));
    const std::vector<Image> images = mipImages(*map.image, levels);
    Json row = {{"file", name}, {"page", page}, {"map", map.name}};
    row["width"] = map.image->width;
    row["height"] = map.image->height;
    Image seen;
    const auto done = isTexture(options_.container)                 ? writeTexture(name, map, images, levels, row, seen)
                      : options_.container == MapContainer::PngRgbm ? writeRgbm(name, map, images.front(), row, seen)
                                                                    : writeHalf(name, map, images.front(), row, seen);
    if (!done) return done.error();
    row.update(differenceOf(seen, *map.image, baked_.flat[page], levels.front()));
    return row;
  }

 private:
  Error unfit(const std::string& name, const std::string& why) const {
    return usageError(name + ": the map holds " + why +
                      "; use --format exr-half for signed maps and --format png-rgbm for large values");
  }

  Expected<void> writeTexture(const std::string& name, const PageMap& map, std::span<const Image> images,
                              std::span<const ChartTexels> texels, Json& row, Image& seen) {
    GpuTexture texture{options_.texels, map.image->width, map.image->height, 1, {}, metadataOf(baked_, map.name)};
    if (map.isSigned && texture.format == TexelFormat::Bc6h) texture.format = TexelFormat::Bc6hSigned;
    std::size_t bytes = 0;
    for (std::size_t level = 0; level < (options_.mips ? images.size() : 1); ++level) {
      if (const auto why = whyUnfit(texture.format, images[level])) return unfit(name, *why);
      std::vector<float> weights(texels[level].kept.size());
      std::ranges::transform(texels[level].kept, weights.begin(),
                             [](std::uint8_t kept) { return kept != 0 ? 1.0f : kFilledWeight; });
      texture.levels.push_back(encodeTexels(texture.format, images[level], weights));
      bytes += texture.levels.back().size();
    }
    row["texels"] = traitsOf(texture.format).name;
    row["levels"] = texture.levels.size();
    row["textureBytes"] = bytes;
    seen = decodeTexels(texture.format, texture.levels.front(), texture.width, texture.height);
    const std::vector<std::uint8_t> file =
        options_.container == MapContainer::Ktx2 ? ktx2File(texture) : ddsFile(texture);
    return folder_.add(name, std::span<const std::uint8_t>(file));
  }

  Expected<void> writeRgbm(const std::string& name, const PageMap& map, const Image& image, Json& row, Image& seen) {
    if (!std::ranges::all_of(image.pixels, [](float v) { return std::isfinite(v); }))
      return unfit(name, "a value that is not finite");
    const float most = *std::max_element(image.pixels.begin(), image.pixels.end());
    if (most > range_)
      return usageError(name + ": the map holds " + std::to_string(most) + ", more than --rgbm-range " +
                        std::to_string(range_) + "; raise it, or leave it out");
    const Image rgbm = encodeRgbm(image, range_);
    seen = decodeRgbm(rgbm, range_);
    row["texels"] = "rgbm";
    row["range"] = range_;
    row["decodeFormula"] = "map = range * (A * RGB)^2, A and RGB from 0 to 1 as they are stored, not sRGB";
    WriteImageOptions options;
    options.format = PixelFormat::U8;
    options.metadata = metadataOf(baked_, map.name);
    options.metadata["lumel:rgbmRange"] = std::to_string(range_);
    options.metadata["lumel:rgbm"] = row["decodeFormula"];
    return folder_.add(name, rgbm, options);
  }

  Expected<void> writeHalf(const std::string& name, const PageMap& map, const Image& image, Json& row, Image& seen) {
    if (const auto why = whyUnfit(TexelFormat::Half, image)) return unfit(name, *why);
    seen = decodeTexels(TexelFormat::Half, encodeTexels(TexelFormat::Half, image), image.width, image.height);
    row["texels"] = "half";
    WriteImageOptions options;
    options.format = PixelFormat::Half;
    options.metadata = metadataOf(baked_, map.name);
    return folder_.add(name, image, options);
  }

  const BakedScene& baked_;
  const MapExportOptions& options_;
  ExportFolder& folder_;
  float range_ = 1.0f;
};

}  // namespace

Expected<void> checkFits(const Encoding& encoding, const MapExportOptions& options) {
  if (!encoding.isSigned() || options.flatAlone) return {};
  const bool isUnsigned = options.container == MapContainer::PngRgbm ||
                          (isTexture(options.container) && options.texels == TexelFormat::Rgb9e5);
  if (!isUnsigned) return {};
  const std::string format = options.container == MapContainer::PngRgbm ? "png-rgbm" : "rgb9e5";
  return usageError("maps of " + encoding.name() + " may be negative, which " + format +
                    " cannot hold; use --texels bc6h or half with --format ktx2 or dds, or --flat-only");
}

Expected<Json> exportMaps(const BakedScene& baked, std::span<const ChartTexels> texels, const MapExportOptions& options,
                          ExportFolder& folder, Progress& progress) {
  if (auto done = checkFits(*baked.encoding, options); !done) return done.error();
  MapWriter writer(baked, options, folder);
  std::size_t count = 0;
  for (std::size_t page = 0; page < texels.size(); ++page) count += mapsOf(baked, page, options.flatAlone).size();
  progress.begin("export", count);
  Json rows = Json::array();
  for (std::size_t page = 0; page < texels.size(); ++page) {
    const std::vector<ChartTexels> levels = mipTexels(texels[page]);
    for (const PageMap& map : mapsOf(baked, page, options.flatAlone)) {
      if (progress.cancelled()) return interrupted();
      auto row = writer.write(page, map, levels);
      if (!row) return row.error();
      rows.push_back(*std::move(row));
      progress.advance(1);
    }
  }
  progress.end();
  return rows;
}

}  // namespace lumel
