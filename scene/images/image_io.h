// The one door to OpenImageIO (and through it OpenEXR): images from and to files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/files/file_set.h"
#include "scene/image.h"
#include "scene/images/loaded_image.h"

namespace lumel {

enum class PixelsAs { Floats, Stored };  // Stored: files of unsigned bytes leave image.pixels empty and fill `bytes`

/// Reads any format that OpenImageIO knows. Errors: Input, naming the file; Interrupted.
Expected<LoadedImage> readImage(const std::filesystem::path& file, const Progress& progress = noProgress());

/// The same from encoded bytes in memory (glTF images: PNG, JPEG, WebP, ...). `name` is for messages.
Expected<LoadedImage> readImage(std::span<const std::uint8_t> encoded, const std::string& name,
                                PixelsAs as = PixelsAs::Floats);

/// Width and height from an image's header alone; 0 x 0 if it cannot be read from memory.
std::array<int, 2> imageSize(std::span<const std::uint8_t> encoded);

enum class PixelFormat { U8, U16, Half, Float };

struct WriteImageOptions {
  PixelFormat format = PixelFormat::Float;      // U8 and U16 store clamp(value, 0, 1) rounded to nearest
  std::vector<std::string> channelNames;        // empty: the format's default (R, G, B, A)
  std::map<std::string, std::string> metadata;  // string attributes (EXR, TIFF; PNG as text)
  /// EXR by run lengths instead of zip: of floats whose lower bits are noise zip makes files 5 to 9% smaller, in 13
  /// times the time.
  bool noisy = false;
  bool mayHoldNan = false;  // values that stand for what is not known; else a NaN is an error
};

/// Writes by the file's extension, complete before a reader sees it (a FileSet of one). Values are stored as they are
/// (no colour conversion). Errors: Failed (cannot write, or a value that the format cannot hold: a finite value beyond
/// 65504 with Half, a NaN unless options allow it), Usage (unknown extension), Interrupted.
Expected<void> writeImage(const std::filesystem::path& file, const Image& image, const WriteImageOptions& options = {},
                          const Progress& progress = noProgress());

/// The same for a file of a set, which puts it in place.
Expected<void> writeImage(const PendingFile& file, const Image& image, const WriteImageOptions& options = {},
                          const Progress& progress = noProgress());

/// The same in parts, for images that do not fit in memory: rows from the top down, then finish.
class ImageWriter {
 public:
  static Expected<ImageWriter> open(const PendingFile& file, int width, int height, int channels,
                                    const WriteImageOptions& options = {});
  ImageWriter(ImageWriter&&) noexcept;
  ImageWriter& operator=(ImageWriter&&) noexcept;
  ~ImageWriter();

  /// The next rows.height rows, `rows` as wide and deep as the file.
  Expected<void> write(const Image& rows, const Progress& progress = noProgress());
  /// Completes the file: every byte has been taken by the system. Every row must have been written.
  Expected<void> finish();

 private:
  struct State;
  explicit ImageWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Encodes as PNG (8-bit) in memory, for embedding.
Expected<std::vector<std::uint8_t>> encodePng(const Image& image);

inline float srgbToLinear(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }
inline float linearToSrgb(float c) { return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f; }

}  // namespace lumel
