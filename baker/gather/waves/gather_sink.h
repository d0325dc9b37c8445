// What the texels of a wave gather in one pass, and how what rays and light samples find is added to it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/waves/gather_kernels.h"
#include "baker/gather/waves/gather_scene.h"
#include "baker/gather/waves/gather_tracer.h"
#include "baker/gather/waves/light_effort.h"
#include "baker/gather/waves/wave_points.h"
#include "baker/rays/non_finite.h"
#include "baker/rays/stratified_net.h"
#include "lightmap/maps/projection_probe.h"

namespace lumel {

/// What the texels of a wave gathered in one pass: sums over its samples.
struct GatheredTexel {
  Vec3d flat{0};
  std::array<Vec3d, kMostMaps> maps{};
  std::array<Vec3d, CacheLevels::kMost> levels{};  // flat light of the cache's levels, unless endless
  std::array<Vec3d, kProbeNormals> probes{};       // where the texel is probed
  Vec3d seen{0};  // with GatherScene::indirectOnly: flat light from what rays see shine by itself, not in the maps
  std::uint32_t backFaces = 0;  // rays that met backs
};

struct GatheredWave {
  std::array<GatheredTexel, kLanes> texels;
  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::vector<NonFiniteSample> nonFinite;
};

/// Adds light to the maps and to the levels of the cache.
struct GatherSink {
  const GatherScene& scene;
  std::span<const PackedColor> cache;
  GatheredWave& result;
  std::uint32_t page;
  std::span<const TexelCoord> coords;
  std::size_t probedLane = kLanes;  // at most one texel of a wave is probed
  std::size_t maps = scene.encoding.mapCount();
  MapSums sums{};
  MapTotals totals{};
  bool tallied = false;  // whether the gather rays are
  LightTally rays{};
  std::array<float, kLanes> perPlace{};  // what light is multiplied by to be tallied

  /// Radiance that a texel reflects, by level.
  const PackedColor* reflectedBy(std::uint32_t texel) const {
    return cache.data() + std::size_t{texel} * static_cast<std::size_t>(scene.levels.count);
  }
  void prefetch(std::uint32_t texel) const {
    if (scene.levels.count > 0) __builtin_prefetch(reflectedBy(texel));
  }
  void report(std::size_t lane, std::uint32_t sample) { result.nonFinite.push_back({page, coords[lane], sample}); }

  void tally(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    if (tallied) rays.add(lane, perPlace[lane] * luminance(light) * std::max(0.0f, dirTangent.z));
  }
  void addSeen(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    result.texels[lane].seen += Vec3d(light * std::max(0.0f, dirTangent.z));
  }
  void addProbes(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    for (std::size_t i = 0; i < kProbeNormals; ++i)
      result.texels[lane].probes[i] += Vec3d(light * std::max(0.0f, glm::dot(dirTangent, probeNormals()[i])));
  }
  void addToMaps(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    const MapKernels kernels = scene.encoding.kernels(dirTangent);
    for (std::size_t map = 0; map <= maps; ++map) {
      const float k = map == 0 ? std::max(0.0f, dirTangent.z) : kernels[map - 1];
      for (int channel = 0; channel < 3; ++channel)
        sums.sum[3 * map + static_cast<std::size_t>(channel)][lane] += light[channel] * k;
    }
    if (lane == probedLane) addProbes(lane, dirTangent, light);
  }
  /// The same for all lanes; `sampleOf(lane)` names a sample that is not finite.
  template <class SampleOf>
  void addToMaps(const Vec3Lanes& dirTangent, const Vec3Lanes& light, SampleOf sampleOf) {
    KernelLanes kernels;
    scene.encoding.laneKernels(dirTangent.x, dirTangent.y, dirTangent.z, kernels);
    if (addLight(dirTangent, kernels, maps, light, sums))
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (!isFinite(light[lane])) report(lane, sampleOf(lane));
    if (probedLane < kLanes && isFinite(light[probedLane]))
      addProbes(probedLane, dirTangent[probedLane], light[probedLane]);
  }
  /// Light of `depth` bounces, for every level that holds so many.
  void addToLevels(std::size_t lane, const Vec3& dirTangent, const Vec3& light, int depth) {
    if (scene.levels.endless) return;
    const Vec3d flat(light * std::max(0.0f, dirTangent.z));
    for (int level = std::max(0, depth - scene.levels.base); level < scene.levels.count; ++level)
      result.texels[lane].levels[static_cast<std::size_t>(level)] += flat;
  }
  /// What a texel that was found after `depth` hits sends on, for the levels that read it.
  void passOnLevels(std::size_t lane, const Vec3& dirTangent, const Vec3& beta, std::uint32_t texel, int depth) {
    const CacheLevels& levels = scene.levels;
    if (levels.endless) return;
    const Vec3 weight = beta * std::max(0.0f, dirTangent.z);
    for (int level = 0; level < levels.count; ++level)
      if (const int source = levels.read(levels.base + level, depth); source >= 0)
        result.texels[lane].levels[static_cast<std::size_t>(level)] +=
            Vec3d(weight * unpackColor(reflectedBy(texel)[source]));
  }

  // What GatherTracer asks of a sink.
  void light(const Flight& flight, const Vec3& radiance, int depth) {
    const Vec3 light = flight.beta * radiance;
    if (!isFinite(light)) return report(flight.lane, flight.sample);
    if (depth == 0 && scene.indirectOnly) return addSeen(flight.lane, flight.dirTangent, light);
    tally(flight.lane, flight.dirTangent, light);
    addToMaps(flight.lane, flight.dirTangent, light);
    addToLevels(flight.lane, flight.dirTangent, light, depth);
  }
  void texel(const Flight& flight, std::uint32_t texel) {
    if (const int level = scene.levels.read(scene.bounces, flight.depth); level >= 0) {
      const Vec3 light = flight.beta * unpackColor(reflectedBy(texel)[level]);
      if (!isFinite(light)) return report(flight.lane, flight.sample);
      tally(flight.lane, flight.dirTangent, light);
      addToMaps(flight.lane, flight.dirTangent, light);
    }
    passOnLevels(flight.lane, flight.dirTangent, flight.beta, texel, flight.depth);
  }
  void backFace(const Flight& flight) { ++result.texels[flight.lane].backFaces; }

  /// Hands the sums over to the result.
  void finish();
};

}  // namespace lumel
