// Light at points in space, which have no normal: from all directions, for light volumes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/surface_cache.h"
#include "baker/light/light_transport.h"
#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

/// The light that arrives at a point.
struct SpaceLight {
  /// Integral over the sphere of radiance times harmonics() of the direction that it comes from, in world space; red,
  /// green, blue.
  std::array<Vec3, kHarmonics> sh{};
  /// The same times cubeKernels(): irradiance / pi on the faces of a cube.
  std::array<Vec3, kCubeFaces> cube{};
  /// Share of the rays that met the back of a single-sided surface, 0..1: near 1 inside of solids.
  float backFaces = 0.0f;

  /// Mean over the sphere.
  Vec3 meanRadiance() const { return sh[0] * kMeanPerConstant; }
  /// 1 / (4 pi Y_00).
  static constexpr float kMeanPerConstant = 0.28209479f;
};

struct SpaceOptions {
  int samples = 256;  // rays per point, and light samples of each kind of light
  std::uint64_t seed = 1;
  bool indirectOnly = false;  // without what arrives straight from lights, shining surfaces and the sky
};

/// Gathers the light at points in world space: lights are sampled at them, and rays find what `surfaces` knows of the
/// surfaces around, with as many bounces as the bake that it is from. Unbiased given the cache. `surfaces` must be of
/// the same ray scene as `transport`. Results depend on scene, points and options alone, never on the number of
/// threads. Samples that are not finite are left out. Errors: Interrupted.
Expected<std::vector<SpaceLight>> gatherInSpace(const LightTransport& transport, const SurfaceCache& surfaces,
                                                std::span<const Vec3> points, const SpaceOptions& options,
                                                Progress& progress);

}  // namespace lumel
