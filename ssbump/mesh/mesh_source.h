// A high-poly mesh seen from a low-poly one, or from a flat tile: normals and occlusion per texel by rays against the
// mesh itself, so that overhangs count.
#pragma once

#include <filesystem>
#include <optional>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/scene.h"
#include "ssbump/maps/bake_report.h"
#include "ssbump/maps/map_set.h"
#include "ssbump/occlusion/lobe.h"
#include "ssbump/occlusion/ray_occlusion.h"

namespace lumel::ssbump {

struct MeshSettings {
  int width = 512, height = 512;  // of the maps
  // Flat tile (no low-poly mesh): seen from +y, t = +x, b = -z, centred on the origin. 0: the mesh's own extent.
  float tileWidth = 0, tileHeight = 0;
  bool wrap = true;  // the tile repeats (flat tile only)
  int uvSet = 0;     // of the low-poly mesh; must not overlap, 0..1
  float cage = 0;    // how far in front of and behind the low-poly surface to look; 0: 5% of its diagonal
  int dilate = 8;    // texels that the maps grow beyond the low-poly charts
  RaySettings rays;  // reach does not apply: rays are as long as the mesh
  MapSettings maps;
};

/// What the texels of a map see: unit normals (t, b, n), visibility per lobe, and which texels hold a surface.
struct MeshTexels {
  Image normals, occlusion, coverage;
};

/// `low` null: the flat tile. Errors: Input (no triangles, no such UV set, not finite), Failed (memory), Interrupted.
/// A texel whose ray meets nothing is flat and open. Independent of threads.
Expected<MeshTexels> gatherMesh(const Scene& high, const Scene* low, const MeshSettings& settings,
                                std::span<const Lobe> lobes, Progress& progress);

/// Bakes files to files. An empty `low` stands for the flat tile. Errors as above and of loading and writing.
Expected<BakeReport> bakeMesh(const std::filesystem::path& high, const std::filesystem::path& low,
                              const MeshSettings& settings, Progress& progress);

}  // namespace lumel::ssbump
