#include "scene/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "scene/check.h"

namespace lumel {
namespace {

constexpr int kMaxDimension = 65536;
constexpr int kRowsAtOnce = 128;  // of a file being written: a multiple of the rows that EXR compresses together

using Head = std::array<std::uint8_t, 32>;  // a file's first bytes, zero where it is shorter

/// Whether the file stores indices into a table of colours. OpenImageIO expands them and says so for some formats only:
/// PNG's colour type and TGA's image type are read from the header.
bool storesPalette(const OIIO::ImageSpec& spec, std::string_view format, const Head& head) {
  if (format == "png") return head[25] == 3;
  if (format == "targa") return head[2] == 1 || head[2] == 9;
  if (format == "bmp") return spec.get_int_attribute("bmp:bitsperpixel", 24) <= 8;
  return format == "gif" || spec.get_string_attribute("tiff:ColorSpace") == "palette";
}

Expected<LoadedImage> readOpened(OIIO::ImageInput& input, const std::string& name, const Head& head,
                                 const Progress& progress = noProgress()) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0) return inputError(name + ": the image has no pixels");
  if (spec.width > kMaxDimension || spec.height > kMaxDimension)
    return inputError(name + ": " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
                      " pixels; at most " + std::to_string(kMaxDimension) + " on a side are read");
  LoadedImage loaded;
  loaded.format = input.format_name();
  loaded.bitsPerChannel = static_cast<int>(spec.format.size()) * 8;
  loaded.isFloat = spec.format.is_floating_point();
  loaded.paletted = storesPalette(spec, loaded.format, head);
  loaded.channelNames.assign(spec.channelnames.begin(), spec.channelnames.end());
  for (const OIIO::ParamValue& attribute : spec.extra_attribs)
    if (attribute.type().basetype == OIIO::TypeDesc::STRING || attribute.type().basevalues() == 1)
      loaded.metadata[attribute.name().string()] = attribute.get_string();
  loaded.image = Image(spec.width, spec.height, spec.nchannels);
  const auto stop = [](void* p, float) { return static_cast<const Progress*>(p)->cancelled(); };
  const bool read = input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, loaded.image.pixels.data(),
                                     OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride, stop,
                                     const_cast<Progress*>(&progress));
  if (progress.cancelled()) return interrupted();
  if (!read) return inputError(name + ": cannot be read: " + input.geterror());
  return loaded;
}

/// The extension chooses the decoder: OpenImageIO tries all readers only for files on disk.
const char* formatOf(std::span<const std::uint8_t> encoded) {
  const auto startsWith = [&](std::initializer_list<int> magic, std::size_t at = 0) {
    if (encoded.size() < at + magic.size()) return false;
    std::size_t i = at;
    for (int m : magic)
      if (encoded[i++] != m) return false;
    return true;
  };
  return startsWith({0x89, 'P', 'N', 'G'})                                          ? "png"
         : startsWith({0xFF, 0xD8})                                                 ? "jpeg"
         : startsWith({'R', 'I', 'F', 'F'}) && startsWith({'W', 'E', 'B', 'P'}, 8) ? "webp"
         : startsWith({0x76, 0x2F, 0x31, 0x01})                                     ? "openexr"
         : startsWith({'D', 'D', 'S', ' '})                                         ? "dds"
         : startsWith({'B', 'M'})                                                   ? "bmp"
         : startsWith({'#', '?'})                                                   ? "hdr"
         : startsWith({'I', 'I', 42, 0}) || startsWith({'M', 'M', 0, 42})           ? "tiff"
                                                                                    : "targa";
}

}  // namespace

std::array<int, 2> imageSize(std::span<const std::uint8_t> encoded) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(encoded.data()), encoded.size());
  const auto input = OIIO::ImageInput::open(std::string("memory.") + formatOf(encoded), nullptr, &memory);
  if (!input) {
    OIIO::geterror();  // or it would be printed at exit
    return {0, 0};
  }
  return {input->spec().width, input->spec().height};
}

Expected<LoadedImage> readImage(const std::filesystem::path& file, const Progress& progress) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(file, ec)) return inputError(file.string() + ": no such file");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = OIIO::ImageInput::open(file.string(), &config);
  if (!input) return inputError(file.string() + ": not an image that can be read: " + OIIO::geterror());
  Head head{};
  std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(head.data()), head.size());
  return readOpened(*input, file.string(), head, progress);
}

Expected<LoadedImage> readImage(std::span<const std::uint8_t> encoded, const std::string& name) {
  Head head{};
  std::copy_n(encoded.begin(), std::min(encoded.size(), head.size()), head.begin());
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(encoded.data()), encoded.size());
  const char* format = formatOf(encoded);
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
      auto result =
          input ? readOpened(*input, name, head)
                : Expected<LoadedImage>(inputError(name + ": not an image that can be read: " + OIIO::geterror()));
      std::error_code ec;
      std::filesystem::remove(file, ec);
      return result;
    }
    return inputError(name + ": not an image that can be read: " + OIIO::geterror());
  }
  return readOpened(*input, name, head);
}

struct ImageWriter::State {
  explicit State(const std::filesystem::path& file) : pending(file) {}
  PendingFile pending;
  std::unique_ptr<OIIO::ImageOutput> output;
  OIIO::ImageSpec spec;
  PixelFormat format = PixelFormat::Float;
  int width = 0, height = 0, channels = 0, nextRow = 0;
  bool complete = false;

  std::string name() const { return pending.file().string(); }
  Error failed(const std::string& why) const { return failure(name() + ": cannot be written: " + why); }
  ~State() {
    if (!complete && nextRow > 0) output->close();
  }
};

ImageWriter::ImageWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ImageWriter::ImageWriter(ImageWriter&&) noexcept = default;
ImageWriter& ImageWriter::operator=(ImageWriter&&) noexcept = default;
ImageWriter::~ImageWriter() = default;

Expected<ImageWriter> ImageWriter::open(const std::filesystem::path& file, int width, int height, int channels,
                                        const WriteImageOptions& options) {
  const std::string name = file.string();
  const OIIO::TypeDesc type = options.format == PixelFormat::U8     ? OIIO::TypeDesc::UINT8
                              : options.format == PixelFormat::U16  ? OIIO::TypeDesc::UINT16
                              : options.format == PixelFormat::Half ? OIIO::TypeDesc::HALF
                                                                    : OIIO::TypeDesc::FLOAT;
  auto state = std::make_unique<State>(file);
  state->output = OIIO::ImageOutput::create(name);
  if (!state->output) return usageError(name + ": unknown image type; use .exr, .png, .tga, .tif or .hdr");
  OIIO::ImageSpec spec(width, height, channels, type);
  if (!options.channelNames.empty()) spec.channelnames = options.channelNames;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (std::string_view(state->output->format_name()) == "openexr") {
    spec.attribute("compression", "zip");
    // OpenImageIO adds the time of day where there is none, and equal images would be unequal files.
    spec.attribute("DateTime", "");
  }
  for (const auto& [key, value] : options.metadata) spec.attribute(key, value);
  state->format = options.format;
  state->width = width;
  state->height = height;
  state->channels = channels;
  state->spec = std::move(spec);
  // The encoder opens with the first rows (libpng complains aloud about a file without any), so try the place itself
  // now.
  std::FILE* trial = std::fopen(state->pending.temporary().c_str(), "wb");
  if (!trial) return state->failed(std::strerror(errno));
  std::fclose(trial);
  return ImageWriter(std::move(state));
}

Expected<void> ImageWriter::write(const Image& rows, const Progress& progress) {
  State& s = *state_;
  LUMEL_CHECK(rows.width == s.width && rows.channels == s.channels && s.nextRow + rows.height <= s.height);
  for (std::size_t i = 0; i < rows.pixels.size(); ++i) {
    const float v = rows.pixels[i];
    const auto where = [&] {
      const std::size_t pixel = i / static_cast<std::size_t>(s.channels), width = static_cast<std::size_t>(s.width);
      return s.name() + ": pixel (" + std::to_string(pixel % width) + ", " +
             std::to_string(pixel / width + static_cast<std::size_t>(s.nextRow)) + ")";
    };
    if (std::isnan(v)) return failure(where() + " is not a number");
    if (s.format == PixelFormat::Half && std::abs(v) > 65504.0f)
      return failure(where() + " is " + std::to_string(v) + ", beyond half's 65504; write float");
  }
  for (int y = 0; y < rows.height; y += kRowsAtOnce) {
    if (progress.cancelled()) return interrupted();
    if (s.nextRow == 0 && !s.output->open(s.pending.temporary().string(), s.spec))
      return s.failed(s.output->geterror());
    const int count = std::min(kRowsAtOnce, rows.height - y);
    if (!s.output->write_scanlines(s.nextRow, s.nextRow + count, 0, OIIO::TypeDesc::FLOAT, rows.at(0, y)))
      return s.failed(s.output->geterror());
    s.nextRow += count;
  }
  return {};
}

Expected<PendingFile> ImageWriter::finish() {
  State& s = *state_;
  LUMEL_CHECK(s.nextRow == s.height && !s.complete);
  s.complete = true;
  if (!s.output->close()) return s.failed(s.output->geterror());
  // Some writers (PNG) do not tell when the disk is full: what cannot be read to its end was not written.
  auto written = OIIO::ImageInput::open(s.pending.temporary().string());
  std::vector<float> last(static_cast<std::size_t>(s.spec.width) * static_cast<std::size_t>(s.spec.nchannels));
  if (!written || !written->read_scanline(s.height - 1, 0, OIIO::TypeDesc::FLOAT, last.data())) {
    OIIO::geterror();  // about reading, of no use here
    return s.failed("it is not whole; is the disk full?");
  }
  return std::move(s.pending);
}

Expected<void> ImageWriter::commit() {
  auto pending = finish();
  if (!pending) return pending.error();
  return putInPlace({&*pending, 1});
}

Expected<void> writeImage(const std::filesystem::path& file, const Image& image, const WriteImageOptions& options,
                          const Progress& progress) {
  auto writer = ImageWriter::open(file, image.width, image.height, image.channels, options);
  if (!writer) return writer.error();
  if (auto done = writer->write(image, progress); !done) return done;
  return writer->commit();
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
