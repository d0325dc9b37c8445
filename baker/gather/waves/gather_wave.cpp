#include "baker/gather/waves/gather_wave.h"

#include <algorithm>
#include <bit>

namespace lumel {
namespace {

/// Within a place light differs by less, from texel to texel.
constexpr float kOnePlace = 0.01f;

}  // namespace

GatherWave::GatherWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count,
                       Emitters sampled)
    : wave_(scene, page, first, count),
      transport_(scene.transport.with(sampled)),
      near_(wave_),
      pilot_(scene.transport.rays) {}

/// By what light is multiplied to be compared from lane to lane: where a wave lies in several places, each counts
/// alike.
static std::array<float, kLanes> sharesOf(std::span<const float> places) {
  std::array<float, kLanes> shares;
  shares.fill(1.0f);
  if (places.empty()) return shares;
  const auto [least, most] = std::ranges::minmax(places);
  if (least >= kOnePlace * most) return shares;
  for (std::size_t lane = 0; lane < places.size(); ++lane)
    shares[lane] = places[lane] > 0.0f ? most / places[lane] : 0.0f;
  return shares;
}

void GatherWave::gather(std::uint32_t first, std::uint32_t end, std::span<const PackedColor> cache,
                        std::span<const std::uint8_t> buried, std::span<const float> places,
                        std::span<LightSpread> spreads, GatheredWave& result) {
  GatherSink sink{wave_.scene, cache, result, wave_.page,
                  std::span(wave_.scene.texels[wave_.page].coords).subspan(wave_.first, wave_.count)};
  for (std::size_t lane = 0; lane < wave_.count; ++lane)
    if (buried[lane]) wave_.points.leaveOut(lane);
  for (std::size_t lane = 0; lane < wave_.count; ++lane) wave_.covered[lane] = wave_.points.covered(lane);
  coveredCount_ = static_cast<std::size_t>(std::count(wave_.covered.begin(), wave_.covered.end(), true));
  if (coveredCount_ == 0) return;
  for (std::size_t lane = 0; lane < wave_.count; ++lane)
    if ((wave_.first + lane) % kProbeStride == 0) sink.probedLane = lane;
  sink.perPlace = sharesOf(places);
  const auto seenToArrive = [&] {
    // Where texels take light from other lamps than hits do, they teach nothing.
    const bool teaches = transport_.straight == nullptr;
    return punctualChoice(transport_.punctual, wave_.scene.strategies, teaches ? spreads : std::span<LightSpread>());
  };
  GatherTracer tracer(transport_, wave_.scene.map, wave_.scene.reflectance, wave_.scene.lastDepth, seenToArrive(),
                      sink);
  for (std::uint32_t sample = first; sample < end;) {
    const NetRange net = netAt(sample, end);
    if (!spreads.empty()) gatherLight(net, spreads, sink);
    if (!spreads.empty() && isPilot(net.first)) tracer.choosePunctual(seenToArrive());
    near_.gather(wave_, net, sink);
    wave_.points.draw(wave_.samplers, kFootprint, net.first, std::min(WavePoints::kMost, net.count()));
    sink.tallied = !spreads.empty() && isPilot(net.first);
    gatherRays(net, tracer, sink);
    if (sink.tallied) {
      tracer.finish();
      sink.rays.enter(spreads.back(), net.count(), coveredCount_);
    }
    sink.rays = {};
    sample += net.count();
  }
  tracer.finish();
  result.rays += tracer.rays();
  result.shadowRays += tracer.shadowRays();
  sink.finish();
}

/// Light samples of each strategy, weighed so that they add up to as many as gather rays. Strategies of equal power are
/// sampled from the same points, which are drawn once.
void GatherWave::gatherLight(const NetRange& net, std::span<LightSpread> spreads, GatherSink& sink) {
  const std::size_t strategies = wave_.scene.strategies.size();
  if (startsLightStretch(net.first))
    for (std::size_t k = 0; k < strategies; ++k) spreads[k].power = lightPower(spreads, k);
  std::array<TexelSampler, kLanes> samplers;
  for (std::size_t lane = 0; lane < wave_.count; ++lane) {
    samplers[lane] = TexelSampler(wave_.samplers[lane].seedOf(kLightStretch), lightStretch(net.first), 0, 0);
    wave_.lightSamples.setTexel(static_cast<int>(lane), samplers[lane]);
  }
  lightTallies_.assign(strategies, {});
  const auto powerOf = [](const LightSpread& spread) { return spread.power; };
  for (std::size_t k = 0; k < strategies; ++k) {
    const int power = spreads[k].power;
    if (std::ranges::count(spreads.first(k), power, powerOf) > 0) continue;
    const std::uint32_t first = scaledBy(power, net.first);
    const std::uint32_t count = std::max(1u, scaledBy(power, net.count()));
    const float weight = kInvPi * static_cast<float>(net.count()) / static_cast<float>(count);
    const std::uint32_t block = std::min(WavePoints::kMost, count);
    for (std::uint32_t s = first; s < first + count; s += block) {
      wave_.points.draw(samplers, kFootprint, s, block);
      for (std::size_t same = k; same < strategies; ++same)
        if (spreads[same].power == power) sampleStrategy(same, s, s + block, weight, isPilot(net.first), sink);
    }
    for (std::size_t same = k; same < strategies; ++same)
      if (isPilot(net.first) && spreads[same].power == power)
        lightTallies_[same].enter(spreads[same], count, coveredCount_);
  }
}

/// What a strategy's samples brought to the flat map, and would have brought with nothing in the way.
static void tallyLight(const SampledLight& sampled, const Vec3Lanes& dirTangent,
                       const std::array<float, kLanes>& perPlace, LightTally& tally) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float flat = perPlace[lane] * luminance(sampled.light[lane]) * kInvPi * dirTangent.z[lane];
    if (sampled.shadows.valid[lane]) tally.unshadowed += flat * flat;
    if (sampled.found(lane)) tally.add(lane, flat);
  }
}

/// Samples [first, end), whose points are drawn.
void GatherWave::sampleStrategy(std::size_t strategy, std::uint32_t first, std::uint32_t end, float weight, bool pilot,
                                GatherSink& sink) {
  SampledLight sampled;
  const LightTransport transport = transport_.atTexels();
  const LightStrategy::Kind kind = wave_.scene.strategies[strategy].kind;
  if (kind == LightStrategy::Emissive && !transport.emissive.samples(transport.sampled)) return;
  // While one sample's shadow rays are traced, memory brings the cells of the sky for the next.
  std::array<EnvironmentLight::Places, 2> sky;
  const bool isSky = kind == LightStrategy::Sky;
  const auto findSky = [&](std::uint32_t s) {
    wave_.lightSamples.setSampleOfAll(s);
    sky[s % 2] = wave_.scene.transport.environment.findSky(wave_.lightSamples.draw2D(kSky));
  };
  if (isSky) findSky(first);
  for (std::uint32_t s = first; s < end; ++s) {
    const PointLanes points = wave_.points[s];
    if (isSky && s + 1 < end) findSky(s + 1);
    wave_.lightSamples.setSampleOfAll(s);
    const std::uint64_t rays = takeLight(transport, wave_.scene.strategies[strategy], near_.receivers(points),
                                         wave_.lightSamples, 0, kGatherDensity, sampled, isSky ? &sky[s % 2] : nullptr);
    if (rays == 0) continue;
    sink.result.shadowRays += rays;
    sampled.trace(wave_.scene.transport.rays, TraceMode::Packet);
    Vec3Lanes dirTangent;
    turnToTangent(points.frame, sampled.wi, dirTangent);
    if (pilot) tallyLight(sampled, dirTangent, sink.perPlace, lightTallies_[strategy]);
    keepVisible(sampled.shadows, weight, sampled.light);
    sink.addToMaps(dirTangent, sampled.light, [s](std::size_t) { return s; });
    if (wave_.scene.levels.endless) continue;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (sampled.found(lane) && isFinite(sampled.light[lane]))
        sink.addToLevels(lane, dirTangent[lane], sampled.light[lane], 0);
  }
  settle(sink.sums, sink.maps, sink.totals);
}

void GatherWave::gatherRays(const NetRange& net, GatherTracer<GatherSink>& tracer, GatherSink& sink) {
  net_.fill(wave_.samplers, wave_.covered, net, kDirection);
  const std::uint32_t count = net.count();
  // While one packet is traced, memory is asked for what those before it hit. What is there already is read first: it
  // would wait behind what is asked for.
  for (std::uint32_t step = 0; step < count + kInFlight - 1; ++step) {
    const auto packet = [&](std::uint32_t age) -> Packet& { return packets_[(step - age) % kInFlight]; };
    const auto inFlight = [&](std::uint32_t age) { return step >= age && step - age < count; };
    if (inFlight(0)) {
      packet(0).cell = step;
      launch(packet(0));
    }
    if (inFlight(3)) {
      collect(packet(3), tracer, sink);
      tracer.advance();
      // Sums of a few samples lose nothing as floats.
      if ((packet(3).cell & 15u) == 15u) settle(sink.sums, sink.maps, sink.totals);
    }
    if (inFlight(2)) wave_.scene.map.findTexels(packet(2).lookup);
    if (inFlight(1)) wave_.scene.map.findPixels(packet(1).rays.packet, packet(1).lookup);
    if (inFlight(0)) wave_.scene.map.findTriangles(packet(0).rays.packet, packet(0).lookup);
    if (inFlight(1)) expectSpots(packet(1), tracer);
    if (inFlight(2)) expectLight(packet(2), tracer, sink);
  }
  settle(sink.sums, sink.maps, sink.totals);
}

/// The footprint point of the rays into a cell: any 16 neighbouring cells use all points of a texel, and where a point
/// has two rays they go to opposite sides.
static std::uint32_t pointOf(std::uint32_t cell) { return cell ^ ((cell >> 1) & 8u); }

/// Sends the rays of all lanes into one cell of the net.
void GatherWave::launch(Packet& packet) {
  aimGatherRays(net_.x(packet.cell), net_.y(packet.cell), wave_.points[pointOf(packet.cell)], packet.rays);
  wave_.scene.transport.rays.intersect(packet.rays.packet, wave_.scene.gatherMode.value_or(pilot_.mode()));
  pilot_.see(packet.rays.packet);
}

/// Asks memory for what collect() will read of a packet whose triangles are found, and then whose texels are.
void GatherWave::expectSpots(const Packet& packet, const GatherTracer<GatherSink>& tracer) {
  forEachLane(packet.lookup.others | packet.lookup.near,
              [&](std::size_t lane) { tracer.expectPlace(packet.rays.packet, packet.lookup, lane); });
}
void GatherWave::expectLight(const Packet& packet, const GatherTracer<GatherSink>& tracer, const GatherSink& sink) {
  const TexelMap::Lookup& lookup = packet.lookup;
  for (const std::uint32_t texel : lookup.texels) sink.prefetch(texel != kNoTexel ? texel : 0u);
  forEachLane(lookup.others | lookup.near | lookup.uneven,
              [&](std::size_t lane) { tracer.expectSpot(packet.rays.packet, lookup, lane); });
}

void GatherWave::collect(const Packet& packet, GatherTracer<GatherSink>& tracer, GatherSink& sink) const {
  const AimedRays& rays = packet.rays;
  const TexelMap::Lookup& lookup = packet.lookup;
  const int level = wave_.scene.levels.read(wave_.scene.bounces, 0);
  const std::uint32_t tooCoarse = level >= 0 ? lookup.near | lookup.uneven : 0u;
  const FoundTexels found = sortFound(rays.packet, lookup.texels, lookup.others | tooCoarse | rays.packet.tinted);
  sink.result.rays += static_cast<std::uint64_t>(std::popcount(found.lookedUp | found.others | found.missed));
  Vec3Lanes light;
  if (level >= 0)
    lookUpLight(found, sink.cache.data() + level, static_cast<std::uint32_t>(wave_.scene.levels.count), rays.weight,
                light);
  if (!wave_.scene.levels.endless)
    forEachLane(found.lookedUp, [&](std::size_t lane) {
      sink.passOnLevels(lane, rays.dirTangent[lane], Vec3(rays.weight[lane]), lookup.texels[lane], 0);
    });
  forEachLane(found.others, [&](std::size_t lane) {
    const Flight flight =
        wave_.flightOf(lane, net_.sample(packet.cell, lane), wave_.points[pointOf(packet.cell)], rays);
    tracer.arrive(rays.packet, static_cast<int>(lane), flight, lookup);
  });
  if (found.missed != 0 && wave_.scene.transport.environment.shines()) collectSky(rays, found.missed, light, sink);
  if (sink.tallied)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (isFinite(light[lane])) sink.tally(lane, rays.dirTangent[lane], light[lane]);
  sink.addToMaps(rays.dirTangent, light, [&](std::size_t lane) { return net_.sample(packet.cell, lane); });
}

/// Into `light`, for the lanes whose bits are set.
void GatherWave::collectSky(const AimedRays& rays, std::uint32_t lanes, Vec3Lanes& light, GatherSink& sink) const {
  Vec3Lanes sky;
  wave_.scene.transport.environment.arriving(rays.packet.directions(), rays.pdf, sky);
  forEachLane(lanes, [&](std::size_t lane) {
    const Vec3 arriving = rays.weight[lane] * rays.packet.tint(lane) * sky[lane];
    const bool isSeen = isFinite(arriving) && wave_.scene.indirectOnly;
    if (isSeen)
      sink.addSeen(lane, rays.dirTangent[lane], arriving);
    else if (isFinite(arriving))
      sink.addToLevels(lane, rays.dirTangent[lane], arriving, 0);
    light.set(lane, isSeen ? Vec3(0.0f) : arriving);
  });
}

}  // namespace lumel
