// The maps of a bake in formats that GPUs and image programs read.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "baker/export/export_folder.h"
#include "baker/files/read/baked_scene.h"
#include "lightmap/formats/chart_mips.h"
#include "lightmap/formats/texel_format.h"
#include "scene/base/progress.h"

namespace lumel {

enum class MapContainer { ExrHalf, PngRgbm, Ktx2, Dds };

struct MapExportOptions {
  MapContainer container = MapContainer::Ktx2;
  TexelFormat texels = TexelFormat::Bc6h;  // of KTX2 and DDS; signed maps are then in Bc6hSigned
  std::optional<float> rgbmRange;          // empty: the largest value of all maps
  bool mips = true;                        // of KTX2 and DDS
  bool flatAlone = false;                  // leave out the encoding's own maps
};

/// Whether the encoding's maps can be written so. Errors: Usage, naming what to do instead.
Expected<void> checkFits(const Encoding& encoding, const MapExportOptions& options);

/// Writes every page's maps and the flat one as lightmap-<page>-<map>.<extension>. `baked` has flat maps; `texels` are
/// those of its pages (chartTexels).
/// Returns the description of the maps: for each its file, page, map, format, size in bytes, levels, and how far it is
/// from the bake over covered texels (root mean square of the difference and difference of the means, both over the
/// flat map's mean). Errors: Usage (a value that the format does not hold), Failed, Interrupted.
Expected<nlohmann::ordered_json> exportMaps(const BakedScene& baked, std::span<const ChartTexels> texels,
                                            const MapExportOptions& options, ExportFolder& folder, Progress& progress);

}  // namespace lumel
