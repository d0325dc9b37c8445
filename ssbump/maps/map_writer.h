// One output map: rows as they are made, then its mip chain.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/images/image_io.h"
#include "ssbump/maps/dds.h"
#include "ssbump/maps/mip.h"

namespace lumel::ssbump {

enum class MapKind { Weights, Normals };  // mip levels of normals are made unit again

struct MapOptions {
  std::optional<PixelFormat> format;  // absent: half for EXR, 8 bits for the rest
  bool mips = false;                  // DDS: in the file; else NAME.mip1.EXT, NAME.mip2.EXT, ...
  MipFilter mipFilter = MipFilter::Box;
  std::optional<DdsFormat> ddsFormat;  // absent: as `format` says
  bool wrap = true;                    // what the mip filter finds beyond the edge
};

/// Errors of all functions: Failed (cannot write), Usage (unknown extension, too many channels for the format),
/// Interrupted.
class MapWriter {
 public:
  /// The files join `files`, which puts them in place.
  static Expected<MapWriter> open(FileSet& files, const std::filesystem::path& file, int width, int height,
                                  int channels, MapKind kind, const MapOptions& options,
                                  std::vector<std::string> channelNames, std::map<std::string, std::string> metadata);

  /// The next rows from the top. Memory: a plain map holds no rows; with mips a quarter of the map (box filter, even
  /// sides) or all of it; DDS all of it.
  Expected<void> write(const Image& rows, const Progress& progress);
  /// Completes the map's files.
  Expected<void> finish(FileSet& files, const Progress& progress);

  /// Values above 1 or below 0 that an integer format has cut.
  std::size_t clipped() const { return clipped_; }
  const std::filesystem::path& file() const { return file_.place; }

 private:
  bool halvesAsItGoes() const;
  Expected<void> finishDds(const Progress& progress);

  PendingFile file_;
  int width_ = 0, height_ = 0, channels_ = 0, row_ = 0;
  MapKind kind_ = MapKind::Weights;
  MapOptions options_;
  WriteImageOptions write_;
  std::optional<ImageWriter> stream_;  // absent: DDS
  Image kept_;                         // level 0, or level 1 where it is made as the rows come
  std::size_t clipped_ = 0;
};

}  // namespace lumel::ssbump
