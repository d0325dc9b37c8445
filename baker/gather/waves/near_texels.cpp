#include "baker/gather/waves/near_texels.h"

#include <utility>

namespace lumel {

NearTexels::NearTexels(const WaveTexels& wave) {
  const PunctualLights& lights = wave.scene.transport.atTexels().punctual;
  if (wave.scene.indirectOnly || lights.size() == lights.directional()) return;
  for (std::size_t lane = 0; lane < wave.count; ++lane) {
    if (!wave.covered[lane]) continue;
    Vec3 least, most;
    wave.points.boundsOf(lane, least, most);
    if (!isAnyLightNear(lights, least, most)) continue;
    Texel texel{.lane = lane};
    texel.footprint.clip(wave.scene.atlas, wave.scene.texels[wave.page], wave.first + lane);
    NearLights near = nearLightsOf(lights, texel.footprint);
    perReach2_[lane] = near.perReach2;
    texel.lights = std::move(near.lights);
    if (near.perReach2 > 0.0f) texels_.push_back(std::move(texel));
  }
}

ReceiverLanes NearTexels::receivers(const PointLanes& points) const {
  ReceiverLanes receivers = points.receivers();
  if (!texels_.empty()) receivers.perReach2 = perReach2_.data();
  return receivers;
}

void NearTexels::gather(const WaveTexels& wave, const NetRange& net, GatherSink& sink) const {
  for (const Texel& texel : texels_) {
    if (!wave.covered[texel.lane]) continue;
    for (std::uint32_t sample = net.first; sample < net.first + net.count(); ++sample)
      for (std::size_t light = 0; light < texel.lights.size(); ++light) addSample(wave, texel, light, sample, sink);
    settle(sink.sums, sink.maps, sink.totals);
  }
}

void NearTexels::addSample(const WaveTexels& wave, const Texel& texel, std::size_t light, std::uint32_t sample,
                           GatherSink& sink) {
  const Vec2 u = wave.samplers[texel.lane].get2D(sample, kNearLight + static_cast<std::uint32_t>(light));
  const Vec2 onLight =
      wave.samplers[texel.lane].get2D(sample, kNearLight + kPunctualPoint + static_cast<std::uint32_t>(light));
  const NearSample near =
      sampleNear(wave.scene.transport.atTexels(), wave.scene.atlas, texel.footprint, texel.lights[light], u, onLight);
  if (near.light == Vec3(0.0f)) return;
  const int lane = static_cast<int>(texel.lane);
  ShadowPacket shadow;
  shadow.clear();
  const Vec3 start = near.receiver.startTowards(near.wi);
  shadow.set(lane, start, near.target - start, 1.0f);
  wave.scene.transport.rays.occluded(shadow, TraceMode::Packet);
  ++sink.result.shadowRays;
  if (!shadow.visible(lane)) return;
  const Vec3 brought = near.light * kInvPi, dirTangent = near.frame.toLocal(near.wi);
  if (!isFinite(brought)) return sink.report(texel.lane, sample);
  sink.addToMaps(texel.lane, dirTangent, brought);
  sink.addToLevels(texel.lane, dirTangent, brought, 0);
}

}  // namespace lumel
