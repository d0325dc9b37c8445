// The options that ask for light volumes.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "baker/commands/options.h"
#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

struct VolumeArguments {
  std::optional<std::array<Vec3, 2>> box;  // opposite corners
  bool everywhere = false;
  float cell = 0.5f;  // metres
  int samples = 128;
};

void declareVolumes(OptionTable& options, VolumeArguments& a);

/// The grids that the command line and the scene ask for, without light. Errors: Usage (more points than a volume may
/// have).
Expected<std::vector<LightVolume>> volumesOf(const VolumeArguments& a, const Scene& scene);

}  // namespace lumel
