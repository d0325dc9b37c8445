// The inner loops of the gather, over the lanes of a wave: aiming rays, and adding what they found to the maps.
#pragma once

#include <array>
#include <cstdint>

#include "baker/gather/waves/packed_color.h"
#include "baker/gather/waves/wave_points.h"
#include "baker/rays/lanes.h"
#include "baker/rays/stratified_net.h"
#include "lightmap/maps/encoding.h"

namespace lumel {

/// The gather rays of a wave: each lane's goes out from its own point.
struct AimedRays {
  Vec3Lanes dirTangent;
  alignas(64) float pdf[kLanes] = {};     // per solid angle; light samples are weighed against it
  alignas(64) float weight[kLanes] = {};  // of the light that the ray finds: 1 / (pi pdf)
  RayPacket packet;
};

/// Aims by sampleGatherHemisphere at u = (x, y), kLanes values each. Lanes whose ray would go below the geometric
/// surface, and those without a texel, are not valid: a bent shading normal gathers from there too, where nothing
/// arrives. No component of a ray's direction is nearer to zero than 1e-12 (see TraceMode::Coherent).
void aimGatherRays(const float* x, const float* y, const PointLanes& from, AimedRays& rays);

/// Aims the same rays by the cosine; `pdf` is still the gather's, and there are no weights.
void aimCosineRays(const float* x, const float* y, const PointLanes& from, AimedRays& rays);

/// How many rays of a traced packet found something else than the lane before theirs; 0 to kLanes - 1.
int differentNeighbours(const RayPacket& packet);

/// What the rays of a packet found, as bits of lanes.
struct FoundTexels {
  alignas(64) std::array<std::uint32_t, kLanes> texels;  // by lane; 0 where none is to be looked up
  std::uint32_t lookedUp = 0;
  std::uint32_t others = 0;  // what a ray hit is not to be looked up
  std::uint32_t missed = 0;
};
/// `texels`: kNoTexel where there is none; `others`: bits of more lanes that are not to be looked up.
FoundTexels sortFound(const RayPacket& packet, const std::array<std::uint32_t, kLanes>& texels, std::uint32_t others);

/// light = radiance[texel * stride] * weight for the lanes that are looked up, else 0.
void lookUpLight(const FoundTexels& found, const PackedColor* radiance, std::uint32_t stride, const float* weight,
                 Vec3Lanes& light);

/// Sums of irradiance / pi over a few samples: of the flat map's three colours, then of those of an encoding's maps.
struct alignas(64) MapSums {
  float sum[3 * (1 + kMostMaps)][kLanes] = {};
};
struct alignas(64) MapTotals {
  double sum[3 * (1 + kMostMaps)][kLanes] = {};
};
static_assert(kLanes == kKernelLanes);

/// Adds light that arrives along dirTangent: times max(0, z) to the flat map, times the kernels to the `maps` others.
/// Light that is no number is left out, and what is beyond kMostSampleLight is cut to it; returns whether any light was
/// not finite.
bool addLight(const Vec3Lanes& dirTangent, const KernelLanes& kernels, std::size_t maps, const Vec3Lanes& light,
              MapSums& sums);

/// Light that nothing keeps away, times `weight`; the other lanes' becomes zero.
void keepVisible(const ShadowPacket& shadows, float weight, Vec3Lanes& light);

/// dirTangent = frame.toLocal(dirWorld).
void turnToTangent(const FrameLanes& frame, const Vec3Lanes& dirWorld, Vec3Lanes& dirTangent);

/// Moves the sums of the flat map and `maps` others to the totals.
void settle(MapSums& sums, std::size_t maps, MapTotals& totals);

}  // namespace lumel
