#include "scene/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <system_error>

namespace lumel {
namespace {

constexpr int kMaxDimension = 65536;

Expected<LoadedImage> readOpened(OIIO::ImageInput& input, const std::string& name) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0)
    return inputError(name + ": the image has no pixels");
  if (spec.width > kMaxDimension || spec.height > kMaxDimension)
    return inputError(name + ": " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
                      " pixels; at most " + std::to_string(kMaxDimension) + " on a side are read");
  LoadedImage loaded;
  loaded.format = input.format_name();
  loaded.bitsPerChannel = static_cast<int>(spec.format.size()) * 8;
  loaded.isFloat = spec.format.is_floating_point();
  loaded.paletted = spec.get_int_attribute("png:ColorType", -1) == 3 || spec.get_int_attribute("tiff:ColorSpace", -1) == 3 ||
                    spec.get_string_attribute("tiff:ColorSpace") == "palette" || loaded.format == "gif";
  loaded.channelNames.assign(spec.channelnames.begin(), spec.channelnames.end());
  for (const OIIO::ParamValue& attribute : spec.extra_attribs)
    if (attribute.type().basetype == OIIO::TypeDesc::STRING || attribute.type().basevalues() == 1)
      loaded.metadata[attribute.name().string()] = attribute.get_string();
  loaded.image = Image(spec.width, spec.height, spec.nchannels);
  const int channels = spec.nchannels;
  if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, loaded.image.pixels.data()))
    return inputError(name + ": cannot be read: " + input.geterror());
  return loaded;
}

}  // namespace

Expected<LoadedImage> readImage(const std::filesystem::path& file) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(file, ec)) return inputError(file.string() + ": no such file");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = OIIO::ImageInput::open(file.string(), &config);
  if (!input) return inputError(file.string() + ": not an image that can be read: " + OIIO::geterror());
  return readOpened(*input, file.string());
}

Expected<LoadedImage> readImage(std::span<const std::uint8_t> encoded, const std::string& name) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(encoded.data()), encoded.size());
  // The extension chooses the decoder: OpenImageIO tries all readers only for files on disk.
  const auto startsWith = [&](std::initializer_list<int> magic, std::size_t at = 0) {
    if (encoded.size() < at + magic.size()) return false;
    std::size_t i = at;
    for (int m : magic)
      if (encoded[i++] != m) return false;
    return true;
  };
  const char* format = startsWith({0x89, 'P', 'N', 'G'})                                          ? "png"
                       : startsWith({0xFF, 0xD8})                                                 ? "jpeg"
                       : startsWith({'R', 'I', 'F', 'F'}) && startsWith({'W', 'E', 'B', 'P'}, 8) ? "webp"
                       : startsWith({0x76, 0x2F, 0x31, 0x01})                                     ? "openexr"
                       : startsWith({'D', 'D', 'S', ' '})                                         ? "dds"
                       : startsWith({'B', 'M'})                                                   ? "bmp"
                       : startsWith({'#', '?'})                                                   ? "hdr"
                       : startsWith({'I', 'I', 42, 0}) || startsWith({'M', 'M', 0, 42})           ? "tiff"
                                                                                                  : "targa";
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = OIIO::ImageInput::open(std::string("memory.") + format, &config, &memory);
  if (!input) {
    // Readers without memory support go through a temporary file.
    static std::atomic<int> counter{0};
    const auto file = std::filesystem::temp_directory_path() /
                      ("lumel-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + "." + format);
    if (FILE* f = std::fopen(file.c_str(), "wb")) {
      const bool written = std::fwrite(encoded.data(), 1, encoded.size(), f) == encoded.size();
      std::fclose(f);
      input = written ? OIIO::ImageInput::open(file.string(), &config) : nullptr;
      auto result = input ? readOpened(*input, name)
                          : Expected<LoadedImage>(inputError(name + ": not an image that can be read: " + OIIO::geterror()));
      std::error_code ec;
      std::filesystem::remove(file, ec);
      return result;
    }
    return inputError(name + ": not an image that can be read: " + OIIO::geterror());
  }
  return readOpened(*input, name);
}

Expected<void> writeImage(const std::filesystem::path& file, const Image& image, const WriteImageOptions& options) {
  const std::string name = file.string();
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float v = image.pixels[i];
    const auto where = [&] {
      const std::size_t pixel = i / static_cast<std::size_t>(image.channels);
      return name + ": pixel (" + std::to_string(pixel % static_cast<std::size_t>(image.width)) + ", " +
             std::to_string(pixel / static_cast<std::size_t>(image.width)) + ")";
    };
    if (std::isnan(v)) return failure(where() + " is not a number");
    if (options.format == PixelFormat::Half && std::abs(v) > 65504.0f)
      return failure(where() + " is " + std::to_string(v) + ", beyond half's 65504; write float");
  }
  const OIIO::TypeDesc type = options.format == PixelFormat::U8     ? OIIO::TypeDesc::UINT8
                              : options.format == PixelFormat::U16  ? OIIO::TypeDesc::UINT16
                              : options.format == PixelFormat::Half ? OIIO::TypeDesc::HALF
                                                                    : OIIO::TypeDesc::FLOAT;
  auto output = OIIO::ImageOutput::create(name);
  if (!output) return usageError(name + ": unknown image type; use .exr, .png, .tga, .tif or .hdr");
  OIIO::ImageSpec spec(image.width, image.height, image.channels, type);
  if (!options.channelNames.empty()) spec.channelnames = options.channelNames;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (std::string_view(output->format_name()) == "openexr") spec.attribute("compression", "zip");
  for (const auto& [key, value] : options.metadata) spec.attribute(key, value);
  // OpenImageIO adds the time of day to an EXR that has no DateTime, and equal images would be unequal files.
  if (std::string_view(output->format_name()) == "openexr") spec.attribute("DateTime", "");

  const auto temporary = file.parent_path() / ("." + file.stem().string() + "." + std::to_string(getpid()) + ".part" +
                                               file.extension().string());
  const auto abandon = [&](const std::string& why) -> Error {
    std::error_code ec;
    std::filesystem::remove(temporary, ec);
    return failure(name + ": cannot be written: " + why);
  };
  if (!output->open(temporary.string(), spec)) return abandon(output->geterror());
  if (!output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())) {
    const std::string why = output->geterror();
    output->close();
    return abandon(why);
  }
  if (!output->close()) return abandon(output->geterror());
  std::error_code ec;
  std::filesystem::rename(temporary, file, ec);
  if (ec) return abandon(ec.message());
  return {};
}

Expected<std::vector<std::uint8_t>> encodePng(const Image& image) {
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  auto output = OIIO::ImageOutput::create("memory.png", &memory);
  if (!output) return failure("PNG encoder: " + OIIO::geterror());
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (!output->open("memory.png", spec) || !output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) ||
      !output->close())
    return failure("PNG encoder: " + output->geterror());
  return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
}

}  // namespace lumel
