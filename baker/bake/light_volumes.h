// Light volumes: light at the points of grids in space, gathered from the surfaces of a bake.
#pragma once

#include <span>
#include <vector>

#include "baker/gather/surface_cache.h"
#include "baker/light/light_transport.h"
#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

struct VolumeOptions {
  int samples = 128;  // rays and light samples a point
  bool indirectOnly = false;
  std::uint64_t seed = 1;
};

/// Finds the light of all points of the volumes (volumeOf). Points that lie inside of something, by the share of backs
/// of single-sided surfaces that they see, are moved out by less than half a cell where that is possible, as are those
/// that all but touch a surface; the rest is filled from valid points. Depends on scene, volumes and options alone.
/// `surfaces`: of a bake of that transport. Errors: Interrupted.
Expected<void> bakeVolumes(const LightTransport& transport, const SurfaceCache& surfaces,
                           std::span<LightVolume> volumes, const VolumeOptions& options, Progress& progress);

}  // namespace lumel
