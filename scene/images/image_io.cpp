#include "scene/images/image_io.h"

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
#include <functional>
#include <mutex>
#include <system_error>

#include "scene/base/check.h"
#include "scene/files/file_access.h"
#include "scene/images/dds_file.h"
#include "scene/images/image_type.h"

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

/// Whether a PNG goes on to its last chunk. libpng finds that out too, but says so on standard error.
bool isWholePng(std::uint64_t size, const std::function<bool(std::uint64_t at, std::span<std::uint8_t> bytes)>& read) {
  constexpr std::uint64_t kSignature = 8, kLengthTypeAndSum = 12;
  std::array<std::uint8_t, 8> head{};
  for (std::uint64_t at = kSignature; at + kLengthTypeAndSum <= size;) {
    if (!read(at, head)) return false;
    std::uint64_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | head[i];
    at += length + kLengthTypeAndSum;
    if (std::equal(head.begin() + 4, head.end(), "IEND")) return at <= size;
  }
  return false;
}

bool isPng(const Head& head) {
  constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'P', 'N', 'G', 13, 10, 26, 10};
  return std::equal(kSignature.begin(), kSignature.end(), head.begin());
}

Error cutOff(const std::string& name) { return inputError(name + ": is cut off: the file ends before the image does"); }

Error unreadable(const std::string& name, const std::string& why) {
  if (why.find("could not find a format reader") != std::string::npos)
    return inputError(name +
                      ": is no image of a known kind; use .png, .jpg, .tga, .tif, .bmp, .webp, .dds, .exr or .hdr");
  return inputError(name + ": not an image that can be read" + (why.empty() ? "" : ": ") +
                    why.substr(0, why.find('\n')));
}

Expected<LoadedImage> readOpened(OIIO::ImageInput& input, const std::string& name, const Head& head,
                                 PixelsAs as = PixelsAs::Floats, const Progress& progress = noProgress()) {
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
  const bool asBytes = as == PixelsAs::Stored && spec.format == OIIO::TypeDesc::UINT8;
  if (asBytes) {
    loaded.image.width = spec.width;
    loaded.image.height = spec.height;
    loaded.image.channels = spec.nchannels;
    loaded.bytes.resize(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
  } else {
    loaded.image = Image(spec.width, spec.height, spec.nchannels);
  }
  void* const pixels = asBytes ? static_cast<void*>(loaded.bytes.data()) : loaded.image.pixels.data();
  const std::string noteOfHead = input.geterror();
  const auto stop = [](void* p, float) { return static_cast<const Progress*>(p)->cancelled(); };
  const bool read =
      input.read_image(0, 0, 0, spec.nchannels, asBytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT, pixels,
                       OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride, stop, const_cast<Progress*>(&progress));
  if (progress.cancelled()) return interrupted();
  // Some readers fill in what is missing, note it and go on. What libjpeg skips between markers does no harm.
  const std::string note = input.geterror();
  if ((noteOfHead + note).find("remature end of") != std::string::npos) return cutOff(name);
  if (!read || (!note.empty() && loaded.format != "jpeg")) return unreadable(name, note);
  return loaded;
}

/// OpenImageIO 2.4 names the countries of colour profiles from one table for all threads, which it fills without a lock
/// while it opens a file. Pixels are decoded later, in parallel.
std::unique_ptr<OIIO::ImageInput> openImage(const std::string& name, const OIIO::ImageSpec* config = nullptr,
                                            OIIO::Filesystem::IOProxy* memory = nullptr) {
  static std::mutex one;
  const std::lock_guard lock(one);
  return OIIO::ImageInput::open(name, config, memory);
}

/// An extension for encoded bytes, since OpenImageIO chooses the decoder of an image in memory by its name.
std::string extensionFor(std::span<const std::uint8_t> encoded) {
  const std::string mimeType = imageMimeType(encoded);
  if (mimeType.empty()) return "tga";
  if (mimeType == "image/x-exr") return "exr";
  if (mimeType == "image/vnd.radiance") return "hdr";
  if (mimeType == "image/vnd-ms.dds") return "dds";
  return mimeType.substr(mimeType.find('/') + 1);
}

}  // namespace

std::array<int, 2> imageSize(std::span<const std::uint8_t> encoded) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(encoded.data()), encoded.size());
  const auto input = openImage("memory." + extensionFor(encoded), nullptr, &memory);
  if (!input) {
    OIIO::geterror();  // or it would be printed at exit
    return {0, 0};
  }
  return {input->spec().width, input->spec().height};
}

Expected<LoadedImage> readImage(const std::filesystem::path& file, const Progress& progress) {
  const std::string name = file.string();
  std::error_code ec;
  if (std::filesystem::is_directory(file, ec)) return inputError(name + ": is a folder, not an image file");
  if (!std::filesystem::is_regular_file(file, ec)) return inputError(name + ": no such file");
  std::ifstream bytes(file, std::ios::binary);
  const auto read = [&](std::uint64_t at, std::span<std::uint8_t> into) {
    bytes.clear();
    bytes.seekg(static_cast<std::streamoff>(at));
    bytes.read(reinterpret_cast<char*>(into.data()), static_cast<std::streamsize>(into.size()));
    return bytes.good();
  };
  Head head{};
  read(0, head);
  if (isPng(head) && !isWholePng(std::filesystem::file_size(file, ec), read)) return cutOff(name);
  std::string note;
  if (std::equal(head.begin(), head.begin() + 4, "DDS ")) {
    const auto whole = readFile(file);
    if (!whole) return whole.error();
    note = ddsNote(*whole);
    if (auto wide = readWideDds(*whole, name)) {
      if (*wide && !note.empty()) (*wide)->metadata["ImageDescription"] = note;
      return *std::move(wide);
    }
  }
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = openImage(name, &config);
  if (!input) return unreadable(name, OIIO::geterror());
  auto loaded = readOpened(*input, name, head, PixelsAs::Floats, progress);
  if (loaded && !note.empty()) loaded->metadata["ImageDescription"] = note;
  return loaded;
}

Expected<LoadedImage> readImage(std::span<const std::uint8_t> encoded, const std::string& name, PixelsAs as) {
  const auto read = [&](std::uint64_t at, std::span<std::uint8_t> into) {
    std::copy_n(encoded.begin() + static_cast<std::ptrdiff_t>(at), into.size(), into.begin());
    return true;
  };
  Head head{};
  std::copy_n(encoded.begin(), std::min(encoded.size(), head.size()), head.begin());
  if (isPng(head) && !isWholePng(encoded.size(), read)) return cutOff(name);
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(encoded.data()), encoded.size());
  const std::string extension = extensionFor(encoded);
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = openImage("memory." + extension, &config, &memory);
  if (input) return readOpened(*input, name, head, as);
  // Readers without memory support go through a temporary file.
  static std::atomic<int> counter{0};
  const auto file = std::filesystem::temp_directory_path() /
                    ("lumel-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + "." + extension);
  const std::string_view bytes(reinterpret_cast<const char*>(encoded.data()), encoded.size());
  if (writeBytes({name, file}, bytes)) input = openImage(file.string(), &config);
  auto result = input ? readOpened(*input, name, head, as) : unreadable(name, OIIO::geterror());
  std::error_code ec;
  std::filesystem::remove(file, ec);
  return result;
}

namespace {

/// Remembers the first error of the system: some encoders (PNG's above all) do not report a full disk.
class CheckedFile : public OIIO::Filesystem::IOFile {
 public:
  explicit CheckedFile(std::FILE* file) : IOFile(file, Write) {}
  ~CheckedFile() override { std::fclose(handle()); }

  std::size_t write(const void* data, std::size_t size) override {
    const std::size_t written = IOFile::write(data, size);
    if (written != size) note();
    return written;
  }
  /// 0, or the first error of the system. Asks for what stands in buffers, too.
  int problem() {
    if (std::fflush(handle()) != 0) note();
    return problem_;
  }

 private:
  void note() { problem_ = problem_ != 0 ? problem_ : errno; }
  int problem_ = 0;
};

}  // namespace

struct ImageWriter::State {
  PendingFile file;
  std::unique_ptr<CheckedFile> bytes;  // outlives the encoder
  std::unique_ptr<OIIO::ImageOutput> output;
  OIIO::ImageSpec spec;
  PixelFormat format = PixelFormat::Float;
  bool mayHoldNan = false;
  int nextRow = 0;
  bool complete = false;

  Error failed() const {
    const int problem = bytes->problem();
    const std::string why = output->geterror();  // taken in any case, or it would be printed at exit
    return cannotWrite(file.place, problem != 0 ? std::strerror(problem) : why);
  }
  ~State() {
    if (!complete && nextRow > 0) output->close();
    if (output) output->geterror();
  }
};

ImageWriter::ImageWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ImageWriter::ImageWriter(ImageWriter&&) noexcept = default;
ImageWriter& ImageWriter::operator=(ImageWriter&&) noexcept = default;
ImageWriter::~ImageWriter() = default;

Expected<ImageWriter> ImageWriter::open(const PendingFile& file, int width, int height, int channels,
                                        const WriteImageOptions& options) {
  const std::string name = file.place.string();
  const OIIO::TypeDesc type = options.format == PixelFormat::U8     ? OIIO::TypeDesc::UINT8
                              : options.format == PixelFormat::U16  ? OIIO::TypeDesc::UINT16
                              : options.format == PixelFormat::Half ? OIIO::TypeDesc::HALF
                                                                    : OIIO::TypeDesc::FLOAT;
  auto state = std::make_unique<State>();
  // Without an extension OpenImageIO takes the name for one.
  if (file.place.has_extension()) state->output = OIIO::ImageOutput::create(name);
  if (!state->output || !state->output->supports("ioproxy")) {
    OIIO::geterror();
    return usageError(name + ": unknown image type; use .exr, .png, .tga, .tif or .hdr");
  }
  OIIO::ImageSpec spec(width, height, channels, type);
  if (!options.channelNames.empty()) spec.channelnames = options.channelNames;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  const std::string_view format = state->output->format_name();
  if (format == "openexr") spec.attribute("compression", options.noisy ? "rle" : "zip");
  // A fifteenth larger than zlib's own choice, 6, in a quarter of its time. Other formats may write it into their file.
  if (format == "png") spec.attribute("png:compressionLevel", 4);
  // OpenImageIO adds the time of day where there is none, and equal images would be unequal files.
  spec.attribute("DateTime", "");
  for (const auto& [key, value] : options.metadata) spec.attribute(key, value);
  state->file = file;
  state->format = options.format;
  state->mayHoldNan = options.mayHoldNan;
  state->spec = std::move(spec);
  std::FILE* bytes = std::fopen(file.path.c_str(), "w+b");
  if (!bytes) return cannotWrite(file.place, std::strerror(errno));
  state->bytes = std::make_unique<CheckedFile>(bytes);
  return ImageWriter(std::move(state));
}

Expected<void> ImageWriter::write(const Image& rows, const Progress& progress) {
  State& s = *state_;
  LUMEL_CHECK(rows.width == s.spec.width && rows.channels == s.spec.nchannels &&
              s.nextRow + rows.height <= s.spec.height);
  for (std::size_t i = 0; i < rows.pixels.size(); ++i) {
    const float v = rows.pixels[i];
    const auto where = [&] {
      const std::size_t pixel = i / static_cast<std::size_t>(rows.channels),
                        width = static_cast<std::size_t>(rows.width);
      return s.file.place.string() + ": pixel (" + std::to_string(pixel % width) + ", " +
             std::to_string(pixel / width + static_cast<std::size_t>(s.nextRow)) + ")";
    };
    if (std::isnan(v) && !s.mayHoldNan) return failure(where() + " is not a number");
    if (s.format == PixelFormat::Half && std::abs(v) > 65504.0f)
      return failure(where() + " is " + std::to_string(v) + ", beyond half's 65504; write float");
  }
  for (int y = 0; y < rows.height; y += kRowsAtOnce) {
    if (progress.cancelled()) return interrupted();
    // The file is opened with its first rows, because libpng complains on standard error about a file without any.
    if (s.nextRow == 0 && (!s.output->set_ioproxy(s.bytes.get()) || !s.output->open(s.file.path.string(), s.spec)))
      return s.failed();
    const int count = std::min(kRowsAtOnce, rows.height - y);
    if (!s.output->write_scanlines(s.nextRow, s.nextRow + count, 0, OIIO::TypeDesc::FLOAT, rows.at(0, y)))
      return s.failed();
    s.nextRow += count;
  }
  return {};
}

Expected<void> ImageWriter::finish() {
  State& s = *state_;
  LUMEL_CHECK(s.nextRow == s.spec.height && !s.complete);
  s.complete = true;
  if (!s.output->close() || s.bytes->problem() != 0) return s.failed();
  return {};
}

Expected<void> writeImage(const PendingFile& file, const Image& image, const WriteImageOptions& options,
                          const Progress& progress) {
  auto writer = ImageWriter::open(file, image.width, image.height, image.channels, options);
  if (!writer) return writer.error();
  if (auto done = writer->write(image, progress); !done) return done;
  return writer->finish();
}

Expected<void> writeImage(const std::filesystem::path& file, const Image& image, const WriteImageOptions& options,
                          const Progress& progress) {
  FileSet set;
  auto pending = set.add(file);
  if (!pending) return pending.error();
  if (auto done = writeImage(*pending, image, options, progress); !done) return done;
  return set.commit();
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
