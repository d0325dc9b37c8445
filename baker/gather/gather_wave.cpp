#include "baker/gather/gather_wave.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace lumel {
namespace {

/// Sample patterns of a texel; those of light samples come first.
constexpr std::uint32_t kFootprint = kLightPatterns;
constexpr std::uint32_t kDirection = kLightPatterns + 1;
constexpr std::uint32_t kWarmDirection = kLightPatterns + 2;
constexpr std::uint32_t kHits = kLightPatterns + 3;
constexpr std::uint32_t kWarmHits = kLightPatterns + 4;
constexpr std::uint32_t kLightStretch = kLightPatterns + 5;

/// Collects the start of the cache.
struct WarmSink {
  std::array<WarmTexel, kLanes>& texels;
  std::span<CacheLink> links;

  CacheLink& linkOf(const Flight& flight) { return links[flight.lane * GatherWave::kWarmRays + flight.sample]; }
  void light(const Flight& flight, const Vec3& radiance, int depth) {
    WarmTexel& texel = texels[flight.lane];
    const Vec3 light = flight.beta * radiance;
    if (!isFinite(light)) return;
    (depth == 0 ? texel.seen : texel.relit) += light;
  }
  void texel(const Flight& flight, std::uint32_t texel) {
    linkOf(flight).texel = texel;
    linkOf(flight).weight = packWeight(flight.beta);
  }
  void prefetch(std::uint32_t) const {}
  void backFace(const Flight& flight) { texels[flight.lane].backs |= 1u << flight.sample; }
};

}  // namespace

/// Adds light to the maps and to the levels of the cache.
struct GatherSink {
  const GatherScene& scene;
  std::span<const PackedColor> cache;
  GatheredWave& result;
  std::uint32_t page;
  std::span<const TexelCoord> coords;
  std::size_t probedLane = kLanes;  // at most one texel of a wave is probed
  MapSums sums{};
  MapTotals totals{};
  bool tallied = false;  // whether the gather rays are
  LightTally rays{};
  std::size_t point = 0;  // the footprint point that the ray at hand comes from
  std::array<std::array<std::uint8_t, WavePoints::kMost>, kLanes> backs{};  // rays of a net that met backs, by point

  /// Radiance that a texel reflects, by level.
  const PackedColor* reflectedBy(std::uint32_t texel) const {
    return cache.data() + std::size_t{texel} * static_cast<std::size_t>(scene.levels.count);
  }
  void prefetch(std::uint32_t texel) const {
    if (scene.levels.count > 0) __builtin_prefetch(reflectedBy(texel));
  }
  void report(std::size_t lane, std::uint32_t sample) { result.nonFinite.push_back({page, coords[lane], sample}); }

  void tally(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    if (tallied) rays.add(lane, luminance(light) * std::max(0.0f, dirTangent.z));
  }
  void addSeen(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    result.texels[lane].seen += Vec3d(light * std::max(0.0f, dirTangent.z));
  }
  void addProbes(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    for (std::size_t i = 0; i < kProbeNormals; ++i)
      result.texels[lane].probes[i] += Vec3d(light * std::max(0.0f, glm::dot(dirTangent, probeNormals()[i])));
  }
  void addToMaps(std::size_t lane, const Vec3& dirTangent, const Vec3& light) {
    const Vec3 kernels = scene.kernels(dirTangent);
    const std::array<float, 4> k = {std::max(0.0f, dirTangent.z), kernels.x, kernels.y, kernels.z};
    for (std::size_t map = 0; map < 4; ++map)
      for (int channel = 0; channel < 3; ++channel)
        sums.sum[3 * map + static_cast<std::size_t>(channel)][lane] += light[channel] * k[map];
    if (lane == probedLane) addProbes(lane, dirTangent, light);
  }
  /// The same for all lanes; `sampleOf(lane)` names a sample that is not finite.
  template <class SampleOf>
  void addToMaps(const Vec3Lanes& dirTangent, const Vec3Lanes& light, SampleOf sampleOf) {
    Vec3Lanes kernels;
    if (scene.kernels.clampedDots())
      clampedDots(dirTangent, kernels);
    else
      for (std::size_t lane = 0; lane < kLanes; ++lane) kernels.set(lane, scene.kernels(dirTangent[lane]));
    if (addLight(dirTangent, kernels, light, sums))
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
  void backFace(const Flight& flight) {
    ++result.texels[flight.lane].backFaces;
    ++backs[flight.lane][point];
  }

  /// Ends a net.
  void judgePoints(const NetRange& net) {
    const std::uint32_t each = net.count() / WavePoints::kMost;
    for (std::size_t lane = 0; lane < coords.size(); ++lane) {
      if (each >= 2) result.texels[lane].inside.addNet(backs[lane], each);
      for (std::uint32_t i = net.first; i < std::min(net.first + net.count(), std::uint32_t{GatherWave::kWarmRays});
           ++i)
        result.texels[lane].firstBacks |= std::uint32_t{backs[lane][i - net.first]} << i;
    }
    backs = {};
  }

  /// Hands the sums over to the result.
  void finish() {
    settle(sums, totals);
    for (std::size_t lane = 0; lane < coords.size(); ++lane) {
      const auto map = [&](std::size_t i) {
        return Vec3d(totals.sum[3 * i][lane], totals.sum[3 * i + 1][lane], totals.sum[3 * i + 2][lane]);
      };
      result.texels[lane].flat += map(0);
      for (std::size_t i = 0; i < 3; ++i) result.texels[lane].rnm[i] += map(i + 1);
    }
    totals = {};
  }
};

std::uint32_t packWeight(const Vec3& weight) {
  if (weight == Vec3(1.0f)) return 0x3fffffffu;
  std::uint32_t packed = 0;
  for (int i = 0; i < 3; ++i)
    packed |= static_cast<std::uint32_t>(std::lround(std::clamp(weight[i], 0.0f, 1.0f) * 1023.0f)) << (10 * i);
  return packed;
}

Vec3 unpackWeight(std::uint32_t packed) {
  return Vec3(packed & 1023u, (packed >> 10) & 1023u, (packed >> 20) & 1023u) / 1023.0f;
}

bool WarmTexel::isUneven() const { return backs != (1u << GatherWave::kWarmRays) - 1u && std::popcount(nears) > 1; }

GatherWave::GatherWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count)
    : scene_(scene),
      page_(page),
      first_(first),
      count_(count),
      points_(scene.transport.rays, scene.atlas, scene.texels[page], first, count),
      pilot_(scene.transport.rays) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    const TexelCoord at = scene.texels[page].coords[first + lane];
    samplers_[lane] = TexelSampler(scene.seed, page, at.x, at.y);
    covered_[lane] = points_.covered(lane);
    coveredCount_ += covered_[lane];
    lightSamples_.setTexel(static_cast<int>(lane), samplers_[lane]);
  }
}

/// The point on the primitive that the atlas's triangle comes from, which may be wound the other way round.
TrianglePoint GatherWave::sourceOf(const PlaceOnTriangle& place) const {
  const Surface& surface = scene_.atlas.surfaces[place.triangle.surface];
  const Primitive* primitive = scene_.transport.rays.primitiveOf(surface.instance, surface.primitive);
  const std::uint32_t source = surface.sourceTriangle[place.triangle.triangle];
  const std::array<float, 3> weights = {1.0f - place.weights.x - place.weights.y, place.weights.x, place.weights.y};
  TrianglePoint at{primitive, source, Vec2(0.0f)};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t vertex = surface.indices[std::size_t{3} * place.triangle.triangle + k];
    for (int i = 1; i < 3; ++i)
      if (primitive->indices[std::size_t{3} * source + static_cast<std::size_t>(i)] == surface.sourceVertex[vertex])
        at.barycentric[i - 1] = weights[k];
  }
  return at;
}

/// How much of a triangle's area a texel is.
float GatherWave::shareOf(const TriangleRef& triangle) const {
  const Surface& surface = scene_.atlas.surfaces[triangle.surface];
  const std::uint32_t* corner = surface.indices.data() + std::size_t{3} * triangle.triangle;
  const Vec2 first = surface.lightmapUvs[corner[0]];
  const Vec2 e1 = surface.lightmapUvs[corner[1]] - first, e2 = surface.lightmapUvs[corner[2]] - first;
  const Page& page = scene_.atlas.pages[page_];
  const float pages = 0.5f * std::abs(e1.x * e2.y - e1.y * e2.x);
  return 1.0f / (pages * static_cast<float>(page.width) * static_cast<float>(page.height));
}

/// At the points drawn of a texel; asks memory for what meanReflectance reads.
void GatherWave::findAlbedos(std::size_t lane, WarmAlbedos& albedos) const {
  const Materials& materials = scene_.transport.materials;
  TriangleRef measured;
  const Texture* texture = nullptr;
  for (std::uint32_t i = 0; i < kWarmLights; ++i) {
    const PlaceOnTriangle place = points_.place(lane, i);
    const TrianglePoint point = sourceOf(place);
    if (i == 0 || !(place.triangle == measured)) {
      measured = place.triangle;
      // A mean would hold what is cut away. One over all that a point stands for would reach beyond the texel.
      const bool whole = materials.material(point.primitive->material).alphaMode == AlphaMode::Opaque;
      const float uvWidth = whole ? materials.albedoWidth(point, 0.25f / kWarmLights * shareOf(measured)) : 0.0f;
      texture = materials.albedoTexture(point.primitive->material, uvWidth);
    }
    albedos.points[i] = point;
    albedos.lookups[i] = materials.findAlbedo(point, texture);
    albedos.lookups[i].prefetch();
  }
}

/// By area and where the surface is opaque.
Vec3 GatherWave::meanReflectance(const WarmAlbedos& albedos) const {
  Vec3 sum(0.0f);
  float opacities = 0.0f;
  for (std::size_t i = 0; i < kWarmLights; ++i) {
    const float opacity = scene_.transport.materials.opacity(albedos.points[i]);
    sum += Materials::albedo(albedos.lookups[i]) * opacity;
    opacities += opacity;
  }
  return opacities > 0.0f ? sum / opacities : Vec3(0.0f);
}

void GatherWave::warmDirect(std::array<WarmTexel, kLanes>& texels, GatheredWave& counts) {
  for (std::uint32_t s = 0; s < kWarmLights; ++s) {
    const ReceiverLanes receivers = points_[s].receivers();
    lightSamples_.setSampleOfAll(s);
    counts.shadowRays += directLight(scene_.transport, receivers, lightSamples_, 0, TraceMode::Packet, kGatherDensity,
                                     [&](int lane, const Vec3& wi, const Vec3& light) {
                                       const auto l = static_cast<std::size_t>(lane);
                                       const Vec3 flat = light * (glm::dot(wi, receivers.ns[l]) * kInvPi);
                                       if (isFinite(flat)) texels[l].direct += flat / static_cast<float>(kWarmLights);
                                     });
  }
}

Flight GatherWave::flightOf(std::size_t lane, std::uint32_t sample, const PointLanes& from,
                            const AimedRays& rays) const {
  return {.lane = static_cast<std::uint32_t>(lane),
          .sample = sample,
          .key = samplers_[lane].seedOf(kHits),
          .dirTangent = rays.dirTangent[lane],
          .beta = Vec3(rays.weight[lane]),
          .origin = from.p[lane],
          .pdf = rays.pdf[lane]};
}

std::array<WarmTexel, kLanes> GatherWave::warmUp(std::span<CacheLink> links, GatheredWave& counts) {
  std::array<WarmTexel, kLanes> texels;
  points_.draw(samplers_, kFootprint, 0, kWarmLights);
  // While one texel's memory is on its way, the one before is read.
  std::array<WarmAlbedos, 2> albedos;
  for (std::size_t lane = 0; lane <= count_; ++lane) {
    if (lane < count_ && covered_[lane]) findAlbedos(lane, albedos[lane % 2]);
    if (lane > 0 && covered_[lane - 1]) texels[lane - 1].reflectance = meanReflectance(albedos[(lane - 1) % 2]);
  }
  warmDirect(texels, counts);

  WarmSink sink{texels, links};
  GatherTracer tracer(scene_.transport, scene_.map, scene_.reflectance, scene_.lastDepth, sink);
  SampleLanes samples = lightSamples_;
  AimedRays& rays = packets_[0].rays;
  for (std::uint32_t s = 0; s < kWarmRays; ++s) {
    const PointLanes from = points_[s];
    samples.setSampleOfAll(s);
    const UnitSquareLanes u = samples.draw2D(kWarmDirection);
    // By the cosine every ray counts alike, so that no texel passes on more than it receives.
    aimCosineRays(u.x, u.y, from, rays);
    scene_.transport.rays.intersect(rays.packet, TraceMode::Packet);
    for (std::size_t lane = count_; lane < kLanes; ++lane) rays.packet.valid[lane] = 0;
    TexelMap::Lookup& lookup = packets_[0].lookup;
    scene_.map.findAll(rays.packet, lookup);
    forEachLane(lookup.near, [&](std::size_t lane) { texels[lane].nears |= 1u << s; });
    lookup.near = 0;  // links lead to texels
    Flight flight;
    tracer.arriveAll(rays.packet, lookup, [&](int lane) -> const Flight& {
      const auto l = static_cast<std::size_t>(lane);
      ++counts.rays;
      flight = flightOf(l, s, from, rays);
      flight.key = samplers_[l].seedOf(kWarmHits);
      flight.beta = Vec3(1.0f);
      return flight;
    });
  }
  tracer.finish();
  counts.rays += tracer.rays();
  counts.shadowRays += tracer.shadowRays();
  for (WarmTexel& texel : texels) {
    texel.seen /= static_cast<float>(kWarmRays);
    texel.relit /= static_cast<float>(kWarmRays);
  }
  return texels;
}

void GatherWave::gather(std::uint32_t first, std::uint32_t end, std::span<const PackedColor> cache,
                        std::span<const std::uint8_t> buried, std::span<LightSpread> spreads,
                        GatheredWave& result) {
  GatherSink sink{scene_, cache, result, page_, std::span(scene_.texels[page_].coords).subspan(first_, count_)};
  for (std::size_t lane = 0; lane < count_; ++lane)
    if (buried[lane]) points_.leaveOut(lane);
  for (std::size_t lane = 0; lane < count_; ++lane) covered_[lane] = points_.covered(lane);
  coveredCount_ = static_cast<std::size_t>(std::count(covered_.begin(), covered_.end(), true));
  if (coveredCount_ == 0) return;
  for (std::size_t lane = 0; lane < count_; ++lane)
    if ((first_ + lane) % kProbeStride == 0) sink.probedLane = lane;
  GatherTracer tracer(scene_.transport, scene_.map, scene_.reflectance, scene_.lastDepth, sink);
  for (std::uint32_t sample = first; sample < end;) {
    const NetRange net = netAt(sample, end);
    if (!spreads.empty()) gatherLight(net, spreads, sink);
    points_.draw(samplers_, kFootprint, net.first, std::min(WavePoints::kMost, net.count()));
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
  const std::size_t strategies = scene_.strategies.size();
  if (startsLightStretch(net.first))
    for (std::size_t k = 0; k < strategies; ++k) spreads[k].power = lightPower(spreads, k);
  std::array<TexelSampler, kLanes> samplers;
  for (std::size_t lane = 0; lane < count_; ++lane) {
    samplers[lane] = TexelSampler(samplers_[lane].seedOf(kLightStretch), lightStretch(net.first), 0, 0);
    lightSamples_.setTexel(static_cast<int>(lane), samplers[lane]);
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
      points_.draw(samplers, kFootprint, s, block);
      for (std::size_t same = k; same < strategies; ++same)
        if (spreads[same].power == power) sampleStrategy(same, s, s + block, weight, isPilot(net.first), sink);
    }
    for (std::size_t same = k; same < strategies; ++same)
      if (isPilot(net.first) && spreads[same].power == power)
        lightTallies_[same].enter(spreads[same], count, coveredCount_);
  }
}

/// What a strategy's samples brought to the flat map, and would have brought with nothing in the way.
static void tallyLight(const SampledLight& sampled, const Vec3Lanes& dirTangent, LightTally& tally) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float flat = luminance(sampled.light[lane]) * kInvPi * dirTangent.z[lane];
    if (sampled.shadows.valid[lane]) tally.unshadowed += flat * flat;
    if (sampled.found(lane)) tally.add(lane, flat);
  }
}

/// Samples [first, end), whose points are drawn.
void GatherWave::sampleStrategy(std::size_t strategy, std::uint32_t first, std::uint32_t end, float weight, bool pilot,
                                GatherSink& sink) {
  SampledLight sampled;
  // While one sample's shadow rays are traced, memory brings the cells of the sky for the next.
  std::array<EnvironmentLight::Places, 2> sky;
  const bool isSky = scene_.strategies[strategy].kind == LightStrategy::Sky;
  const auto findSky = [&](std::uint32_t s) {
    lightSamples_.setSampleOfAll(s);
    sky[s % 2] = scene_.transport.environment.findSky(lightSamples_.draw2D(kSky));
  };
  if (isSky) findSky(first);
  for (std::uint32_t s = first; s < end; ++s) {
    const PointLanes points = points_[s];
    if (isSky && s + 1 < end) findSky(s + 1);
    lightSamples_.setSampleOfAll(s);
    const std::uint64_t rays = takeLight(scene_.transport, scene_.strategies[strategy], points.receivers(),
                                         lightSamples_, 0, kGatherDensity, sampled, isSky ? &sky[s % 2] : nullptr);
    if (rays == 0) continue;
    sink.result.shadowRays += rays;
    scene_.transport.rays.occluded(sampled.shadows, TraceMode::Packet);
    Vec3Lanes dirTangent;
    turnToTangent(points.frame, sampled.wi, dirTangent);
    if (pilot) tallyLight(sampled, dirTangent, lightTallies_[strategy]);
    keepVisible(sampled.shadows, weight, sampled.light);
    sink.addToMaps(dirTangent, sampled.light, [s](std::size_t) { return s; });
    if (scene_.levels.endless) continue;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (sampled.found(lane) && isFinite(sampled.light[lane]))
        sink.addToLevels(lane, dirTangent[lane], sampled.light[lane], 0);
  }
  settle(sink.sums, sink.totals);
}

void GatherWave::gatherRays(const NetRange& net, GatherTracer<GatherSink>& tracer, GatherSink& sink) {
  net_.fill(samplers_, covered_, net, kDirection);
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
      if ((packet(3).cell & 15u) == 15u) settle(sink.sums, sink.totals);
    }
    if (inFlight(2)) scene_.map.findTexels(packet(2).lookup);
    if (inFlight(1)) scene_.map.findPixels(packet(1).rays.packet, packet(1).lookup);
    if (inFlight(0)) scene_.map.findTriangles(packet(0).rays.packet, packet(0).lookup);
    if (inFlight(1)) expectSpots(packet(1), tracer);
    if (inFlight(2)) expectLight(packet(2), tracer, sink);
  }
  sink.judgePoints(net);
  settle(sink.sums, sink.totals);
}

/// The footprint point of the rays into a cell: any 16 neighbouring cells use all points of a texel, and where a point
/// has two rays they go to opposite sides.
static std::uint32_t pointOf(std::uint32_t cell) { return cell ^ ((cell >> 1) & 8u); }

/// Sends the rays of all lanes into one cell of the net.
void GatherWave::launch(Packet& packet) {
  aimGatherRays(net_.x(packet.cell), net_.y(packet.cell), points_[pointOf(packet.cell)], packet.rays);
  scene_.transport.rays.intersect(packet.rays.packet, scene_.gatherMode.value_or(pilot_.mode()));
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
  const int level = scene_.levels.read(scene_.bounces, 0);
  const std::uint32_t tooCoarse = level >= 0 ? lookup.near | lookup.uneven : 0u;
  const FoundTexels found = sortFound(rays.packet, lookup.texels, lookup.others | tooCoarse);
  sink.result.rays += static_cast<std::uint64_t>(std::popcount(found.lookedUp | found.others | found.missed));
  Vec3Lanes light;
  if (level >= 0)
    lookUpLight(found, sink.cache.data() + level, static_cast<std::uint32_t>(scene_.levels.count), rays.weight, light);
  if (!scene_.levels.endless)
    forEachLane(found.lookedUp, [&](std::size_t lane) {
      sink.passOnLevels(lane, rays.dirTangent[lane], Vec3(rays.weight[lane]), lookup.texels[lane], 0);
    });
  forEachLane(found.others, [&](std::size_t lane) {
    const Flight flight = flightOf(lane, net_.sample(packet.cell, lane), points_[pointOf(packet.cell)], rays);
    sink.point = pointOf(packet.cell) % WavePoints::kMost;
    tracer.arrive(rays.packet, static_cast<int>(lane), flight, lookup);
  });
  if (found.missed != 0 && scene_.transport.environment.shines()) collectSky(rays, found.missed, light, sink);
  if (sink.tallied)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (isFinite(light[lane])) sink.tally(lane, rays.dirTangent[lane], light[lane]);
  sink.addToMaps(rays.dirTangent, light, [&](std::size_t lane) { return net_.sample(packet.cell, lane); });
}

/// Into `light`, for the lanes whose bits are set.
void GatherWave::collectSky(const AimedRays& rays, std::uint32_t lanes, Vec3Lanes& light, GatherSink& sink) const {
  Vec3Lanes sky;
  scene_.transport.environment.arriving(rays.packet.directions(), rays.pdf, sky);
  forEachLane(lanes, [&](std::size_t lane) {
    const Vec3 arriving = rays.weight[lane] * sky[lane];
    const bool isSeen = isFinite(arriving) && scene_.indirectOnly;
    if (isSeen)
      sink.addSeen(lane, rays.dirTangent[lane], arriving);
    else if (isFinite(arriving))
      sink.addToLevels(lane, rays.dirTangent[lane], arriving, 0);
    light.set(lane, isSeen ? Vec3(0.0f) : arriving);
  });
}

}  // namespace lumel
