// Occlusion of a height field by rays: Embree against its triangles. Slow, and an independent check of the horizons.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "scene/base/embree.h"
#include "scene/base/progress.h"
#include "scene/image.h"
#include "ssbump/occlusion/height_field.h"
#include "ssbump/occlusion/lobe.h"
#include "ssbump/occlusion/max_levels.h"
#include "ssbump/occlusion/samples.h"

namespace lumel::ssbump {

struct RaySettings {
  int count = 300;  // per texel, all lobes share them
  RaySampling sampling = RaySampling::Stratified;
  std::uint32_t seed = 1;
  int reach = 0;  // texels beyond which nothing occludes; 0 = automaticReach
};

class RayOcclusion {
 public:
  /// Builds the triangles: about 200 bytes per texel. The field must outlive the object. Errors: Failed (memory),
  /// Interrupted.
  static Expected<RayOcclusion> build(const HeightField& field, const RaySettings& settings,
                                      const Progress& progress = noProgress());

  /// Visibility as Horizon::occlusion has it: sum of visible weights over the sum of all weights.
  Image occlusion(const TexelRect& rect, std::span<const Lobe> lobes, Progress& progress = noProgress()) const;
  /// The same for chosen texels only, row by row of `texels`: out[i * lobes + c].
  std::vector<float> occlusionAt(std::span<const std::pair<int, int>> texels, std::span<const Lobe> lobes,
                                 Progress& progress = noProgress()) const;

 private:
  RayOcclusion(const HeightField& field, const RaySettings& settings) : field_(&field), settings_(settings) {}

  const HeightField* field_;
  RaySettings settings_;
  EmbreeDevice device_;
  EmbreeScene scene_;
};

}  // namespace lumel::ssbump
