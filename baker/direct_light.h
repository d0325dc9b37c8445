// Next-event estimation for a wave of surface points: one shadow ray per point and kind of light that the scene has.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "baker/light_transport.h"
#include "baker/sample_lanes.h"
#include "baker/sampling.h"

namespace lumel {

/// A point that receives light; both normals on the side that light is gathered on.
struct Receiver {
  Vec3 p{0};
  Vec3 ng{0, 0, 1};
  Vec3 ns{0, 0, 1};
  Vec3 rayStart{0};

  bool sees(const Vec3& dirWorld) const { return glm::dot(dirWorld, ns) > 0.0f && glm::dot(dirWorld, ng) > 0.0f; }
};

/// The sample patterns that one receiver's decisions use, counted from a base.
enum LightPattern : std::uint32_t { kPunctual, kEmitter, kEmitterPoint, kSun, kSky, kLightPatterns };

/// One way to take a light sample. All that a scene needs (lightStrategies) add up to its direct light.
struct LightStrategy {
  enum Kind { EveryPunctual, NearPunctual, OnePunctual, Emissive, Sun, Sky };
  Kind kind = EveryPunctual;
  std::size_t light = 0;  // of OnePunctual
};

/// No more punctual lights than this are sampled each by itself.
inline constexpr std::size_t kSeparateLights = 8;

/// `separate`: a strategy for each punctual light, where there are few; of more, for each directional one, if these are
/// few, and one that chooses among the rest. Else one that chooses among all.
std::vector<LightStrategy> lightStrategies(const LightTransport& transport, bool separate);

/// The lanes of a wave that want light: those that are `active`.
struct LightLanes {
  std::array<bool, kLanes> active{};
  std::array<Receiver, kLanes> receivers;
};

struct IgnoreLight {
  void operator()(int, const Vec3&, const Vec3&) const {}
};

/// Takes one light sample by `strategy` for every active lane and calls add(lane, wi, radianceOverPdf) for each that is
/// visible, and tried(...) alike for all that were looked for. `surfacePdf(cosTheta)` is the density with which the
/// receiver gathers from a direction, for multiple importance sampling against hits. Returns the number of shadow rays.
template <class SurfacePdf, class Add, class Tried = IgnoreLight>
std::uint64_t sampleLight(const LightTransport& transport, const LightStrategy& strategy, const LightLanes& lanes,
                          const SampleLanes& samples, std::uint32_t patternBase, TraceMode mode, SurfacePdf surfacePdf,
                          Add add, Tried tried = {}) {
  std::uint64_t shadowRays = 0;
  const auto estimate = [&](auto takeSample) {
    ShadowPacket shadows;
    std::array<Vec3, kLanes> light;
    std::array<Vec3, kLanes> wi;
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto l = static_cast<std::size_t>(lane);
      if (!lanes.active[l]) continue;
      const Receiver& receiver = lanes.receivers[l];
      const LightSample s = takeSample(receiver, lane);
      if (s.weight == Vec3(0.0f) || !receiver.sees(s.wi)) continue;
      wi[l] = s.wi;
      light[l] = s.weight;
      if (s.pdf > 0.0f) light[l] *= misWeight(s.pdf, surfacePdf(glm::dot(s.wi, receiver.ns)));
      if (s.distant)
        shadows.set(lane, receiver.rayStart, s.wi, std::numeric_limits<float>::infinity());
      else
        shadows.set(lane, receiver.rayStart, s.target - receiver.rayStart, 1.0f);
      tried(lane, wi[l], light[l]);
      ++shadowRays;
    }
    if (shadowRays == 0) return;
    transport.rays.occluded(shadows, mode);
    for (int lane = 0; lane < kLanes; ++lane)
      if (shadows.visible(lane)) add(lane, wi[static_cast<std::size_t>(lane)], light[static_cast<std::size_t>(lane)]);
  };
  switch (strategy.kind) {
    case LightStrategy::EveryPunctual: {
      const UnitLanes choice = samples.draw1D(patternBase + kPunctual);
      estimate([&](const Receiver& r, int lane) { return transport.punctual.sample(r.p, r.ns, choice.u[lane]); });
      break;
    }
    case LightStrategy::NearPunctual: {
      const UnitLanes choice = samples.draw1D(patternBase + kPunctual);
      estimate([&](const Receiver& r, int lane) { return transport.punctual.sampleNear(r.p, r.ns, choice.u[lane]); });
      break;
    }
    case LightStrategy::OnePunctual:
      estimate([&](const Receiver& r, int) { return transport.punctual.sampleOne(strategy.light, r.p); });
      break;
    case LightStrategy::Emissive: {
      const UnitLanes choice = samples.draw1D(patternBase + kEmitter);
      const UnitSquareLanes point = samples.draw2D(patternBase + kEmitterPoint);
      estimate(
          [&](const Receiver& r, int lane) { return transport.emissive.sample(r.p, choice.u[lane], point[lane]); });
      break;
    }
    case LightStrategy::Sun: {
      const UnitSquareLanes point = samples.draw2D(patternBase + kSun);
      estimate([&](const Receiver&, int lane) { return transport.environment.sampleSun(point[lane]); });
      break;
    }
    case LightStrategy::Sky: {
      const UnitSquareLanes point = samples.draw2D(patternBase + kSky);
      estimate([&](const Receiver&, int lane) { return transport.environment.sampleSky(point[lane]); });
      break;
    }
  }
  return shadowRays;
}

/// One sample by each of the strategies that the scene needs.
template <class SurfacePdf, class Add>
std::uint64_t directLight(const LightTransport& transport, const LightLanes& lanes, const SampleLanes& samples,
                          std::uint32_t patternBase, TraceMode mode, SurfacePdf surfacePdf, Add add) {
  std::uint64_t shadowRays = 0;
  const auto take = [&](bool needed, LightStrategy::Kind kind) {
    if (needed) shadowRays += sampleLight(transport, {kind}, lanes, samples, patternBase, mode, surfacePdf, add);
  };
  take(!transport.punctual.empty(), LightStrategy::EveryPunctual);
  take(!transport.emissive.empty(), LightStrategy::Emissive);
  take(transport.environment.sunSampled(), LightStrategy::Sun);
  take(transport.environment.skySampled(), LightStrategy::Sky);
  return shadowRays;
}

}  // namespace lumel
