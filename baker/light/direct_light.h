// Next-event estimation for a wave of surface points: one shadow ray per point and kind of light that the scene has.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "baker/light/light_transport.h"
#include "baker/light/receiver.h"
#include "baker/rays/sample_lanes.h"
#include "baker/rays/sampling.h"

namespace lumel {

/// The sample patterns that one receiver's decisions use, counted from a base.
enum LightPattern : std::uint32_t { kPunctual, kEmitter, kEmitterPoint, kSun, kSky, kLightPatterns };
/// Added to the base for the point on a lamp that is more than a point, far from all other patterns.
inline constexpr std::uint32_t kPunctualPoint = 0x40000000u;

/// Names one way to take a light sample. The strategies that a scene needs (lightStrategies) add up to its direct
/// light.
struct LightStrategy {
  enum Kind { EveryPunctual, NearPunctual, OnePunctual, Emissive, Sun, Sky };
  Kind kind = EveryPunctual;
  std::size_t light = 0;  // of OnePunctual
};

/// Up to this many punctual lights are sampled each by itself.
inline constexpr std::size_t kSeparateLights = 8;

/// Returns the strategies that a scene needs. With `separate` each punctual light has one of its own where they are
/// few; of more, each directional light has one if these are few, and the rest share one. Else one chooses among all.
std::vector<LightStrategy> lightStrategies(const LightTransport& transport, bool separate);

/// Holds the receivers of a wave; lanes count where `active`.
struct LightLanes {
  LaneFlags active{};
  std::array<Receiver, kLanes> receivers;
  const float* perReach2 = nullptr;  // ReceiverLanes
};

/// Sends a ray from every active receiver into the hemisphere about its shading normal. Density: cosTheta / pi. Those
/// that would go below the geometric surface are not valid.
void aimByCosine(const ReceiverLanes& receivers, const UnitSquareLanes& u, RayPacket& packet, float* pdf);

/// One light sample of every lane.
struct SampledLight {
  Vec3Lanes wi;     // unit, towards the light
  Vec3Lanes light;  // radiance over density, weighed against hits; zero where nothing could arrive
  ShadowPacket shadows;

  bool found(std::size_t lane) const { return shadows.visible(static_cast<int>(lane)); }
  /// Traces the shadow rays; light that comes through surfaces that tint it takes their colours.
  void trace(const RayScene& rays, TraceMode mode) {
    rays.occluded(shadows, mode);
    if (shadows.tinted == 0) return;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if ((shadows.tinted >> lane & 1u) != 0) light.set(lane, light[lane] * shadows.passed[lane]);
  }
};

/// What is learnt of punctual lights while samples are taken, and the groups of the lights that the lanes chose last.
struct PunctualChoice {
  LearntChoice learnt;
  LaneFlags group{};
};

/// Takes one light sample by `strategy` for every active lane. `density` is the one with which the receivers gather
/// from a direction, for multiple importance sampling against hits. Samples whose shadow rays are to be traced are set
/// in `sampled.shadows`; returns their number. `sky` is what findSky() found for these samples, if that is known.
std::uint64_t takeLight(const LightTransport& transport, const LightStrategy& strategy, const ReceiverLanes& receivers,
                        const SampleLanes& samples, std::uint32_t patternBase, const SurfaceDensity& density,
                        SampledLight& sampled, const EnvironmentLight::Places* sky = nullptr,
                        PunctualChoice* punctual = nullptr);

/// Enters what became of samples of EveryPunctual.
void learn(const SampledLight& sampled, const ReceiverLanes& receivers, PunctualChoice& punctual);

/// One sample by each of the strategies that the scene needs: calls add(lane, wi, radianceOverPdf) for each that is
/// visible. Returns the number of shadow rays. `punctual`: how EveryPunctual chooses, and what learns from it; null: it
/// chooses by unshadowed light.
template <class Add>
std::uint64_t directLight(const LightTransport& transport, const ReceiverLanes& receivers, const SampleLanes& samples,
                          std::uint32_t patternBase, TraceMode mode, const SurfaceDensity& density, Add add,
                          PunctualChoice* punctual = nullptr) {
  std::uint64_t shadowRays = 0;
  SampledLight sampled;
  const auto take = [&](bool needed, LightStrategy::Kind kind) {
    if (!needed) return;
    PunctualChoice* choice = kind == LightStrategy::EveryPunctual ? punctual : nullptr;
    const std::uint64_t rays =
        takeLight(transport, {kind}, receivers, samples, patternBase, density, sampled, nullptr, choice);
    if (rays == 0) return;
    shadowRays += rays;
    sampled.trace(transport.rays, mode);
    if (choice != nullptr) learn(sampled, receivers, *choice);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (sampled.found(lane)) add(static_cast<int>(lane), sampled.wi[lane], sampled.light[lane]);
  };
  take(!transport.punctual.empty(), LightStrategy::EveryPunctual);
  take(transport.emissive.samples(transport.sampled), LightStrategy::Emissive);
  take(transport.environment.sunSampled(), LightStrategy::Sun);
  take(transport.environment.skySampled(), LightStrategy::Sky);
  return shadowRays;
}

template <class Add>
std::uint64_t directLight(const LightTransport& transport, const LightLanes& lanes, const SampleLanes& samples,
                          std::uint32_t patternBase, TraceMode mode, const SurfaceDensity& density, Add add,
                          PunctualChoice* punctual = nullptr) {
  Vec3Lanes p, ng, ns, rayStart, lift;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    p.set(lane, lanes.receivers[lane].p);
    ng.set(lane, lanes.receivers[lane].ng);
    ns.set(lane, lanes.receivers[lane].ns);
    rayStart.set(lane, lanes.receivers[lane].rayStart);
    lift.set(lane, lanes.receivers[lane].lift);
  }
  return directLight(transport, ReceiverLanes{lanes.active, p, ng, ns, rayStart, false, lanes.perReach2, &lift},
                     samples, patternBase, mode, density, add, punctual);
}

}  // namespace lumel
