#include "ssbump/maps/map_writer.h"

#include <algorithm>

#include "scene/base/check.h"
#include "scene/files/file_access.h"
#include "ssbump/maps/weights.h"

namespace lumel::ssbump {
namespace {

PixelFormat formatFor(const std::string& extension, const MapOptions& options) {
  return options.format.value_or(extension == ".exr" ? PixelFormat::Half : PixelFormat::U8);
}

DdsFormat ddsFormatFor(const MapOptions& options) {
  if (options.ddsFormat) return *options.ddsFormat;
  switch (options.format.value_or(PixelFormat::U8)) {
    case PixelFormat::U8:
      return DdsFormat::Rgba8;
    case PixelFormat::U16:
      return DdsFormat::Rgba16;
    default:
      return DdsFormat::Rgba16Half;
  }
}

Expected<void> checkFormat(const std::filesystem::path& file, const std::string& extension, int channels,
                           PixelFormat format) {
  const std::string name = file.string();
  if (channels > 4 && extension != ".exr" && extension != ".tif" && extension != ".tiff")
    return usageError(name + ": " + std::to_string(channels) + " channels need .exr or .tif");
  const bool isFloat = format == PixelFormat::Half || format == PixelFormat::Float;
  if (isFloat && (extension == ".png" || extension == ".tga"))
    return usageError(name + ": holds no floats; use --bits 8 or 16, or .exr");
  if (format == PixelFormat::U16 && extension == ".tga")
    return usageError(name + ": TGA holds 8 bits; use .png or --bits 8");
  if (format == PixelFormat::Float && extension == ".dds")
    return usageError(name + ": DDS files hold 8 bits, 16 or half; use --bits half, or .exr");
  if (!isFloat && extension == ".exr") return usageError(name + ": EXR holds floats; use --bits half or float");
  return {};
}

void makeUnit(Image& normals) {
  for (int y = 0; y < normals.height; ++y)
    for (int x = 0; x < normals.width; ++x)
      normals.setRgb(x, y, encodeNormal(decodeNormal(normals.rgb(x, y), Green::Up), Green::Up));
}

std::filesystem::path mipName(const std::filesystem::path& file, std::size_t level) {
  return file.parent_path() / (file.stem().string() + ".mip" + std::to_string(level) + file.extension().string());
}

}  // namespace

Expected<MapWriter> MapWriter::open(FileSet& files, const std::filesystem::path& file, int width, int height,
                                    int channels, MapKind kind, const MapOptions& options,
                                    std::vector<std::string> channelNames,
                                    std::map<std::string, std::string> metadata) {
  const std::string extension = lowerCaseExtension(file);
  MapWriter writer;
  writer.width_ = width;
  writer.height_ = height;
  writer.channels_ = channels;
  writer.kind_ = kind;
  writer.options_ = options;
  writer.write_ = {formatFor(extension, options), std::move(channelNames), std::move(metadata)};
  if (auto good = checkFormat(file, extension, channels, writer.write_.format); !good) return good.error();
  auto pending = files.add(file);
  if (!pending) return pending.error();
  writer.file_ = std::move(*pending);
  if (extension == ".dds") {
    writer.options_.mips = true;
    return writer;
  }
  auto stream = ImageWriter::open(writer.file_, width, height, channels, writer.write_);
  if (!stream) return stream.error();
  writer.stream_.emplace(std::move(*stream));
  return writer;
}

bool MapWriter::halvesAsItGoes() const {
  return stream_ && options_.mipFilter == MipFilter::Box && width_ % 2 == 0 && height_ % 2 == 0;
}

Expected<void> MapWriter::write(const Image& rows, const Progress& progress) {
  const bool integer = write_.format == PixelFormat::U8 || write_.format == PixelFormat::U16;
  if (integer)
    for (float v : rows.pixels) clipped_ += v > 1.0f + 1e-6f || v < -1e-6f ? 1 : 0;
  if (options_.mips) {
    const bool half = halvesAsItGoes() && rows.height % 2 == 0;
    LUMEL_CHECK(half || !halvesAsItGoes());
    if (kept_.empty()) kept_ = half ? Image(width_ / 2, height_ / 2, channels_) : Image(width_, height_, channels_);
    const Image& part = half ? halve(rows, MipFilter::Box, options_.wrap) : rows;
    std::copy(part.pixels.begin(), part.pixels.end(), kept_.at(0, half ? row_ / 2 : row_));
  }
  row_ += rows.height;
  return stream_ ? stream_->write(rows, progress) : Expected<void>();
}

Expected<void> MapWriter::finishDds(const Progress& progress) {
  std::vector<Image> levels = mipLevels(kept_, options_.mipFilter, options_.wrap, progress);
  if (progress.cancelled()) return interrupted();
  levels.insert(levels.begin(), std::move(kept_));
  if (kind_ == MapKind::Normals)
    for (std::size_t i = 1; i < levels.size(); ++i) makeUnit(levels[i]);
  const auto note = write_.metadata.find("ImageDescription");
  return writeDds(file_, levels, ddsFormatFor(options_), note == write_.metadata.end() ? "" : note->second, progress);
}

Expected<void> MapWriter::finish(FileSet& files, const Progress& progress) {
  if (!stream_) return finishDds(progress);
  if (options_.mips && (width_ > 1 || height_ > 1)) {
    std::vector<Image> levels = mipLevels(kept_, options_.mipFilter, options_.wrap, progress);
    if (progress.cancelled()) return interrupted();
    if (halvesAsItGoes()) levels.insert(levels.begin(), std::move(kept_));
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (kind_ == MapKind::Normals) makeUnit(levels[i]);
      auto file = files.add(mipName(file_.place, i + 1));
      if (!file) return file.error();
      if (auto done = writeImage(*file, levels[i], write_, progress); !done) return done;
    }
  }
  return stream_->finish();
}

}  // namespace lumel::ssbump
