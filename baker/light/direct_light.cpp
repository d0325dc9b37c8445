#include "baker/light/direct_light.h"

#include <limits>

namespace lumel {
namespace {

const Vec3Lanes kNoLifts{};

/// Aims shadow rays at the samples that the receivers see, and weighs what these would bring.
template <bool kOpen>
[[gnu::always_inline]] inline int aimShadowsOf(const ReceiverLanes& receivers, const Vec3Lanes& lifts,
                                               const LightSampleLanes& samples, const SurfaceDensity& density,
                                               SampledLight& sampled) {
  const float constant = density.constant, perCosine = density.perCosine;
  RTCRay16& ray = sampled.shadows.ray;
  int count = 0;
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3 wi = samples.wi[lane];
    const float cosTheta = glm::dot(wi, receivers.ns[lane]);
    const Vec3 lift = lifts[lane];
    const bool isLifted = (lift.x != 0.0f) | (lift.y != 0.0f) | (lift.z != 0.0f);
    const bool above = glm::dot(wi, receivers.ng[lane]) > 0.0f;
    const bool sees = kOpen | ((cosTheta > 0.0f) & (above | isLifted));
    const Vec3 weight = samples.weight[lane];
    const bool brings = (weight.x != 0.0f) | (weight.y != 0.0f) | (weight.z != 0.0f);
    const bool taken = (receivers.active[lane] != 0) & sees & brings;
    const float pdf = samples.pdf[lane];
    const float byHit = misWeight(pick(pdf > 0.0f, pdf, 1.0f), constant + perCosine * cosTheta);
    const float share = pick(pdf > 0.0f, byHit, 1.0f);
    sampled.wi.x[lane] = pick(taken, wi.x, 0.0f);
    sampled.wi.y[lane] = pick(taken, wi.y, 0.0f);
    sampled.wi.z[lane] = pick(taken, wi.z, 0.0f);
    sampled.light.x[lane] = pick(taken, weight.x * share, 0.0f);
    sampled.light.y[lane] = pick(taken, weight.y * share, 0.0f);
    sampled.light.z[lane] = pick(taken, weight.z * share, 0.0f);
    const Vec3 start = receivers.rayStart[lane] + pick(above, Vec3(0.0f), lift);
    const bool distant = samples.distant[lane] != 0;
    ray.org_x[lane] = start.x;
    ray.org_y[lane] = start.y;
    ray.org_z[lane] = start.z;
    ray.dir_x[lane] = pick(distant, wi.x, samples.target.x[lane] - start.x);
    ray.dir_y[lane] = pick(distant, wi.y, samples.target.y[lane] - start.y);
    ray.dir_z[lane] = pick(distant, wi.z, samples.target.z[lane] - start.z);
    ray.tfar[lane] = pick(distant, std::numeric_limits<float>::infinity(), 1.0f);
    sampled.shadows.valid[lane] = taken ? -1 : 0;
    count += taken ? 1 : 0;
  }
  return count;
}

LUMEL_FOR_EACH_CPU int aimShadows(const ReceiverLanes& receivers, const Vec3Lanes& lifts,
                                  const LightSampleLanes& samples, const SurfaceDensity& density,
                                  SampledLight& sampled) {
  return aimShadowsOf<false>(receivers, lifts, samples, density, sampled);
}
LUMEL_FOR_EACH_CPU int aimOpenShadows(const ReceiverLanes& receivers, const Vec3Lanes& lifts,
                                      const LightSampleLanes& samples, const SurfaceDensity& density,
                                      SampledLight& sampled) {
  return aimShadowsOf<true>(receivers, lifts, samples, density, sampled);
}

}  // namespace

LUMEL_FOR_EACH_CPU void aimByCosine(const ReceiverLanes& receivers, const UnitSquareLanes& u, RayPacket& packet,
                                    float* pdf) {
  RTCRay16& ray = packet.rayhit.ray;
  RTCHit16& hit = packet.rayhit.hit;
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3 local = sampleCosineHemisphere({u.x[lane], u.y[lane]});
    const Vec3 world = frameAround(receivers.ns[lane]).fromLocal(local);
    const bool above = glm::dot(world, receivers.ng[lane]) > 0.0f;
    pdf[lane] = local.z * kInvPi;
    ray.org_x[lane] = receivers.rayStart.x[lane];
    ray.org_y[lane] = receivers.rayStart.y[lane];
    ray.org_z[lane] = receivers.rayStart.z[lane];
    ray.dir_x[lane] = world.x;
    ray.dir_y[lane] = world.y;
    ray.dir_z[lane] = world.z;
    ray.tfar[lane] = std::numeric_limits<float>::infinity();
    hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    packet.valid[lane] = (receivers.active[lane] != 0) & above ? -1 : 0;
  }
}

std::uint64_t takeLight(const LightTransport& transport, const LightStrategy& strategy, const ReceiverLanes& receivers,
                        const SampleLanes& samples, std::uint32_t patternBase, const SurfaceDensity& density,
                        SampledLight& sampled, const EnvironmentLight::Places* sky, PunctualChoice* punctual) {
  LightSampleLanes taken;
  UnitSquareLanes square;
  const UnitSquareLanes* points = nullptr;
  if (strategy.kind <= LightStrategy::OnePunctual && transport.punctual.hasShapes()) {
    square = samples.draw2D(patternBase + kPunctualPoint);
    points = &square;
  }
  switch (strategy.kind) {
    case LightStrategy::EveryPunctual:
      if (punctual != nullptr)
        transport.punctual.sample(receivers, samples.draw1D(patternBase + kPunctual), punctual->learnt, taken,
                                  punctual->group, points);
      else
        transport.punctual.sample(receivers, samples.draw1D(patternBase + kPunctual), taken, points);
      break;
    case LightStrategy::NearPunctual:
      transport.punctual.sampleNear(receivers, samples.draw1D(patternBase + kPunctual), taken, points);
      break;
    case LightStrategy::OnePunctual:
      transport.punctual.sampleOne(strategy.light, receivers, taken, points);
      break;
    case LightStrategy::Emissive:
      transport.emissive.sample(receivers.p, receivers.active, samples.draw1D(patternBase + kEmitter),
                                samples.draw2D(patternBase + kEmitterPoint), taken, transport.sampled);
      break;
    case LightStrategy::Sun:
      transport.environment.sampleSun(samples.draw2D(patternBase + kSun), taken);
      break;
    case LightStrategy::Sky:
      transport.environment.sampleSky(
          sky != nullptr ? *sky : transport.environment.findSky(samples.draw2D(patternBase + kSky)), taken);
      break;
  }
  const Vec3Lanes& lifts = receivers.lift != nullptr ? *receivers.lift : kNoLifts;
  const int count = receivers.open ? aimOpenShadows(receivers, lifts, taken, density, sampled)
                                   : aimShadows(receivers, lifts, taken, density, sampled);
  sampled.shadows.any = count > 0;
  return static_cast<std::uint64_t>(count);
}

void learn(const SampledLight& sampled, const ReceiverLanes& receivers, PunctualChoice& punctual) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (sampled.shadows.valid[lane] == 0) continue;
    const float cosTheta = glm::dot(sampled.wi[lane], receivers.ns[lane]);
    const float unshadowed = luminance(sampled.light[lane]) * cosTheta;
    punctual.learnt.record(static_cast<std::size_t>(punctual.group[lane]), unshadowed,
                           sampled.found(lane) ? unshadowed : 0.0f);
  }
}

std::vector<LightStrategy> lightStrategies(const LightTransport& transport, bool separate) {
  std::vector<LightStrategy> strategies;
  const PunctualLights& lights = transport.punctual;
  std::size_t alone = 0;
  if (separate && lights.size() <= kSeparateLights)
    alone = lights.size();
  else if (separate && lights.directional() < kSeparateLights)
    alone = lights.directional();
  for (std::size_t i = 0; i < alone; ++i) strategies.push_back({LightStrategy::OnePunctual, i});
  if (alone < lights.size())
    strategies.push_back({alone > 0 ? LightStrategy::NearPunctual : LightStrategy::EveryPunctual});
  if (!transport.emissive.empty()) strategies.push_back({LightStrategy::Emissive});
  if (transport.environment.sunSampled()) strategies.push_back({LightStrategy::Sun});
  if (transport.environment.skySampled()) strategies.push_back({LightStrategy::Sky});
  return strategies;
}

}  // namespace lumel
