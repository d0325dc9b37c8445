#include "baker/gather/waves/gather_kernels.h"

#include <cstring>
#include <limits>

#include "baker/gather/waves/texel_map.h"
#include "baker/rays/non_finite.h"
#include "baker/rays/sampling.h"

namespace lumel {
namespace {

constexpr float kLeastComponent = 1e-12f;

inline float awayFromZero(float component) {
  const float least = pick(component < 0.0f, -kLeastComponent, kLeastComponent);
  return pick((component < kLeastComponent) & (component > -kLeastComponent), least, component);
}

/// `sampleDirection` has filled rays.dirTangent.
[[gnu::always_inline]] inline void aim(const PointLanes& from, AimedRays& rays) {
  RTCRay16& ray = rays.packet.rayhit.ray;
  RTCHit16& hit = rays.packet.rayhit.hit;
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3 world = from.frame[lane].fromLocal(rays.dirTangent[lane]);
    const bool above = glm::dot(world, from.ng[lane]) > 0.0f;
    const Vec3 lift = from.lift[lane];
    const bool isLifted = (lift.x != 0.0f) | (lift.y != 0.0f) | (lift.z != 0.0f);
    const Vec3 start = from.rayStart[lane] + pick(above, Vec3(0.0f), lift);
    rays.pdf[lane] = gatherHemispherePdf(rays.dirTangent.z[lane]);
    ray.org_x[lane] = start.x;
    ray.org_y[lane] = start.y;
    ray.org_z[lane] = start.z;
    ray.dir_x[lane] = awayFromZero(world.x);
    ray.dir_y[lane] = awayFromZero(world.y);
    ray.dir_z[lane] = awayFromZero(world.z);
    ray.tfar[lane] = std::numeric_limits<float>::infinity();
    hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    rays.packet.valid[lane] = above | isLifted ? -1 : 0;
  }
}

}  // namespace

LUMEL_FOR_EACH_CPU void aimGatherRays(const float* x, const float* y, const PointLanes& from, AimedRays& rays) {
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    rays.dirTangent.set(lane, sampleGatherHemisphere({x[lane], y[lane]}));
  aim(from, rays);
  for (std::size_t lane = 0; lane < kLanes; ++lane) rays.weight[lane] = kInvPi / rays.pdf[lane];
}

LUMEL_FOR_EACH_CPU void aimCosineRays(const float* x, const float* y, const PointLanes& from, AimedRays& rays) {
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    rays.dirTangent.set(lane, sampleCosineHemisphere({x[lane], y[lane]}));
  aim(from, rays);
}

LUMEL_FOR_EACH_CPU int differentNeighbours(const RayPacket& packet) {
  const RTCHit16& hit = packet.rayhit.hit;
  int count = 0;
  for (std::size_t lane = 0; lane + 1 < kLanes; ++lane) {
    const bool differs = (hit.geomID[lane] != hit.geomID[lane + 1]) | (hit.primID[lane] != hit.primID[lane + 1]);
    // The triangle of a ray that missed is what the lane found before.
    const bool missed =
        (hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) & (hit.geomID[lane + 1] == RTC_INVALID_GEOMETRY_ID);
    count += (differs & !missed) ? 1 : 0;
  }
  return count;
}

LUMEL_FOR_EACH_CPU FoundTexels sortFound(const RayPacket& packet, const std::array<std::uint32_t, kLanes>& texels,
                                         std::uint32_t others) {
  FoundTexels found;
  alignas(64) std::uint32_t ofRays[kLanes], ofHits[kLanes], ofTexels[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    ofRays[lane] = packet.valid[lane] != 0 ? 1u << lane : 0u;
    ofHits[lane] = packet.rayhit.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID ? ofRays[lane] : 0u;
    ofTexels[lane] = (texels[lane] != kNoTexel ? ofHits[lane] : 0u) & ~others;
    found.texels[lane] = ofTexels[lane] != 0 ? texels[lane] : 0u;
  }
  // Loops of their own: in the one above the compiler would leave all scalar.
  std::uint32_t rays = 0, hits = 0, lookedUp = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) rays |= ofRays[lane];
  for (std::size_t lane = 0; lane < kLanes; ++lane) hits |= ofHits[lane];
  for (std::size_t lane = 0; lane < kLanes; ++lane) lookedUp |= ofTexels[lane];
  found.lookedUp = lookedUp;
  found.others = hits & ~lookedUp;
  found.missed = rays & ~hits;
  return found;
}

LUMEL_FOR_EACH_CPU void lookUpLight(const FoundTexels& found, const PackedColor* radiance, std::uint32_t stride,
                                    const float* weight, Vec3Lanes& light) {
  static_assert(sizeof(PackedColor) == 8);
  std::array<LaneWords, 2> columns;
  turnRows<2>([&](std::size_t lane) { return radiance + std::size_t{found.texels[lane]} * stride; }, columns);
  alignas(64) std::uint32_t packed[2][kLanes];
  std::memcpy(packed, &columns, sizeof packed);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool isLookedUp = (found.lookedUp & (1u << lane)) != 0;
    const Vec3 arriving = weight[lane] * unpackColor(packed[0][lane], packed[1][lane]);
    light.set(lane, pick(isLookedUp, arriving, Vec3(0.0f)));
  }
}

LUMEL_FOR_EACH_CPU bool addLight(const Vec3Lanes& dirTangent, const KernelLanes& kernels, std::size_t maps,
                                 const Vec3Lanes& light, MapSums& sums) {
  alignas(64) float red[kLanes], green[kLanes], blue[kLanes];
  int lost = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float any = light.x[lane] + light.y[lane] + light.z[lane];
    const bool isNumber = any == any;
    lost |= any - any == 0.0f ? 0 : 1;
    red[lane] = isNumber ? std::min(light.x[lane], kMostSampleLight) : 0.0f;
    green[lane] = isNumber ? std::min(light.y[lane], kMostSampleLight) : 0.0f;
    blue[lane] = isNumber ? std::min(light.z[lane], kMostSampleLight) : 0.0f;
  }
  const auto addTo = [&](std::size_t map, const float* k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      sums.sum[3 * map][lane] += red[lane] * k[lane];
      sums.sum[3 * map + 1][lane] += green[lane] * k[lane];
      sums.sum[3 * map + 2][lane] += blue[lane] * k[lane];
    }
  };
  alignas(64) float flat[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) flat[lane] = std::max(0.0f, dirTangent.z[lane]);
  addTo(0, flat);
  for (std::size_t map = 0; map < maps; ++map) addTo(1 + map, kernels.of[map]);
  return lost != 0;
}

LUMEL_FOR_EACH_CPU void keepVisible(const ShadowPacket& shadows, float weight, Vec3Lanes& light) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool visible = (shadows.valid[lane] != 0) & (shadows.ray.tfar[lane] >= 0.0f);
    light.x[lane] = pick(visible, light.x[lane] * weight, 0.0f);
    light.y[lane] = pick(visible, light.y[lane] * weight, 0.0f);
    light.z[lane] = pick(visible, light.z[lane] * weight, 0.0f);
  }
}

LUMEL_FOR_EACH_CPU void turnToTangent(const FrameLanes& frame, const Vec3Lanes& dirWorld, Vec3Lanes& dirTangent) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) dirTangent.set(lane, frame[lane].toLocal(dirWorld[lane]));
}

LUMEL_FOR_EACH_CPU void settle(MapSums& sums, std::size_t maps, MapTotals& totals) {
  for (std::size_t map = 0; map < 3 * (1 + maps); ++map)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      totals.sum[map][lane] += static_cast<double>(sums.sum[map][lane]);
      sums.sum[map][lane] = 0.0f;
    }
}

}  // namespace lumel
