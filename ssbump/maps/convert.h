// ssbump maps from one convention, handedness or kind to another, from and to normal maps, blended and cross-faded.
#pragma once

#include <filesystem>
#include <optional>

#include "ssbump/maps/map_writer.h"
#include "ssbump/maps/weights.h"

namespace lumel::ssbump {

/// What a file holds: an ssbump map in an encoding, or (encoding absent) a normal map with its green channel's sense.
struct MapForm {
  std::optional<Encoding> encoding;
  Green green = Green::Up;
};

struct ConvertSettings {
  std::optional<MapForm> from;  // absent: as the file's metadata says
  MapForm to;
  std::filesystem::path detail;  // an ssbump map, blended in evenly
  float detailRepeats = 1;
  std::filesystem::path crossFade;  // a second map of the input's size
  float crossFadeAmount = 0.5f;     // 0: the input, 1: the second map
  std::filesystem::path albedo;     // its luminance multiplies the result
  MapOptions options;
};

/// Alpha passes through. Errors: Input (too few channels, not finite, unknown form), Usage, Failed, Interrupted.
Expected<void> convertMap(const std::filesystem::path& input, const std::filesystem::path& output,
                          const ConvertSettings& settings, const Progress& progress = noProgress());

/// A second map for work in `encoding` (detail, cross-fade): three channels and more, brought over from the form that
/// the file's metadata name, or from `form` where they name none; normal maps become weights. Errors: Input,
/// Interrupted.
Expected<Image> readMapAs(const std::filesystem::path& file, const MapForm& form, const Encoding& encoding,
                          const Progress& progress);

/// A colour map as linear values: sRGB unless the file holds floats. Errors: Input, Interrupted.
Expected<Image> readAlbedo(const std::filesystem::path& file, const Progress& progress);

/// The form that a file's metadata names, if it names one.
std::optional<MapForm> formFromMetadata(const LoadedImage& image);

/// What the channels of a material's map hold: as its metadata say, else as stated (words of parseConvention and
/// parseHand), else squared and right-handed. Errors: Input, without a name: fewer than three channels, a normal map,
/// another basis than the RNM one, or metadata that contradict what is stated.
Expected<Encoding> materialEncoding(const LoadedImage& image, const std::string& convention, const std::string& hand);

}  // namespace lumel::ssbump
