// Makes the maps that were asked for from normals and occlusion, band by band. Height maps and meshes share it.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "ssbump/maps/map_writer.h"
#include "ssbump/maps/weights.h"
#include "ssbump/occlusion/lobe.h"

namespace lumel::ssbump {

/// Files to write; empty paths are not made.
struct MapFiles {
  std::filesystem::path ssbump;
  std::filesystem::path weights;    // D alone, without occlusion
  std::filesystem::path occlusion;  // o alone
  std::filesystem::path ambient;    // cosine-weighted ambient occlusion
  std::filesystem::path normal;     // the normals behind the weights
  std::filesystem::path recovered;  // the normals that the ssbump map gives back
};

struct MapSettings {
  MapFiles files;
  MapOptions options;
  Encoding encoding;
  Green green = Green::Up;  // of written normal maps
  std::vector<Vec3> basis;  // empty: the three RNM vectors
  LobeShape lobe = LobeShape::Hemisphere;
  float coneOpeningDegrees = 120;
  std::filesystem::path albedo;  // sRGB unless a float file; its luminance multiplies the ssbump map
  std::filesystem::path mask;    // first channel goes to the ssbump map's alpha, untouched
  std::filesystem::path detail;  // an ssbump map (as its metadata say, else in the same encoding), blended in evenly
  float detailRepeats = 1;
};

class MapSet {
 public:
  /// `alpha`: the input's own alpha plane (may be empty; a mask file wins). Opens every file before any work is done.
  /// Errors: Input (albedo, mask or detail), Usage, Failed, Interrupted; of write and commit: Failed, Interrupted.
  static Expected<MapSet> open(const MapSettings& settings, int width, int height, Image alpha,
                               std::map<std::string, std::string> metadata, const Progress& progress);

  /// The lobes whose occlusion `write` expects, one channel each, in order.
  const std::vector<Lobe>& lobes() const { return lobes_; }

  /// The next rows: unit normals (t, b, n) in three channels, visibility in lobes().size() channels.
  Expected<void> write(const Image& normals, const Image& occlusion, const Progress& progress);
  /// Completes every file, then puts all in place; if one cannot be, none is replaced. Before it nothing is visible,
  /// and nothing is left if it is not reached.
  Expected<void> commit(const Progress& progress);

  /// "FILE: 12 values above 1 were cut ..." for integer formats.
  std::vector<std::string> warnings() const;

 private:
  Expected<void> readImages(const Progress& progress);
  Expected<void> openFiles(const std::map<std::string, std::string>& metadata);
  Image compose(const Image& normals, const Image& occlusion, bool withOcclusion) const;
  void modulate(Image& rows) const;
  void addAlpha(Image& rows) const;

  FileSet files_;
  MapSettings settings_;
  int width_ = 0, height_ = 0, row_ = 0;
  std::vector<Lobe> lobes_;
  std::size_t basisSize_ = 3;
  Image alpha_, albedo_, detail_;
  std::optional<MapWriter> ssbump_, weights_, occlusion_, ambient_, normal_, recovered_;
};

}  // namespace lumel::ssbump
