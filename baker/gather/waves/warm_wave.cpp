#include "baker/gather/waves/warm_wave.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace lumel {
namespace {

/// WarmWave::raysFindWide. With 8 a hall under 10,000 small lamps had 2.8 times the error, with 3 it has 2% more.
constexpr double kMostSpread = 3.0;

/// Collects the start of the cache.
struct WarmSink {
  std::array<WarmTexel, kLanes>& texels;
  std::span<CacheLink> links;

  CacheLink& linkOf(const Flight& flight) { return links[flight.lane * kWarmRays + flight.sample]; }
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

bool WarmTexel::isUneven() const { return backs != (1u << kWarmRays) - 1u && std::popcount(nears) > 1; }

/// The point on the primitive that the atlas's triangle comes from, which may be wound the other way round.
TrianglePoint WarmWave::sourceOf(const PlaceOnTriangle& place) const {
  const Surface& surface = wave_.scene.atlas.surfaces[place.triangle.surface];
  const Primitive* primitive = wave_.scene.transport.rays.primitiveOf(surface.instance, surface.primitive);
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
float WarmWave::shareOf(const TriangleRef& triangle) const {
  const Surface& surface = wave_.scene.atlas.surfaces[triangle.surface];
  const std::uint32_t* corner = surface.indices.data() + std::size_t{3} * triangle.triangle;
  const Vec2 first = surface.lightmapUvs[corner[0]];
  const Vec2 e1 = surface.lightmapUvs[corner[1]] - first, e2 = surface.lightmapUvs[corner[2]] - first;
  const Page& page = wave_.scene.atlas.pages[wave_.page];
  const float pages = 0.5f * std::abs(e1.x * e2.y - e1.y * e2.x);
  return 1.0f / (pages * static_cast<float>(page.width) * static_cast<float>(page.height));
}

/// At the points drawn of a texel; asks memory for what meanReflectance reads.
void WarmWave::findAlbedos(std::size_t lane, WarmAlbedos& albedos) const {
  const Materials& materials = wave_.scene.transport.materials;
  TriangleRef measured;
  const Texture* texture = nullptr;
  for (std::uint32_t i = 0; i < kWarmLights; ++i) {
    const PlaceOnTriangle place = wave_.points.place(lane, i);
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
Vec3 WarmWave::meanReflectance(const WarmAlbedos& albedos) const {
  Vec3 sum(0.0f);
  float opacities = 0.0f;
  for (std::size_t i = 0; i < kWarmLights; ++i) {
    const float opacity = wave_.scene.transport.materials.opacity(albedos.points[i]);
    sum += Materials::albedo(albedos.lookups[i]) * opacity;
    opacities += opacity;
  }
  return opacities > 0.0f ? sum / opacities : Vec3(0.0f);
}

void WarmWave::warmDirect(std::array<WarmTexel, kLanes>& texels, GatheredWave& counts) {
  PunctualChoice punctual = punctualChoice(transport_.punctual, {}, {});
  for (std::uint32_t s = 0; s < kWarmLights; ++s) {
    const ReceiverLanes receivers = wave_.points[s].receivers();
    wave_.lightSamples.setSampleOfAll(s);
    counts.shadowRays += directLight(
        transport_, receivers, wave_.lightSamples, 0, TraceMode::Packet, kGatherDensity,
        [&](int lane, const Vec3& wi, const Vec3& light) {
          const auto l = static_cast<std::size_t>(lane);
          const Vec3 flat = light * (glm::dot(wi, receivers.ns[l]) * kInvPi);
          if (isFinite(flat)) texels[l].direct += flat / static_cast<float>(kWarmLights);
        },
        punctual.learnt.isUseful() ? &punctual : nullptr);
  }
}

/// Lamps that light by bounces alone: what texels reflect of them is known from here.
void WarmWave::warmHidden(std::array<WarmTexel, kLanes>& texels, GatheredWave& counts) {
  const LightTransport hidden = transport_.with(*transport_.hidden);
  SampledLight sampled;
  for (std::uint32_t s = 0; s < kWarmLights && !hidden.punctual.empty(); ++s) {
    const ReceiverLanes receivers = wave_.points[s].receivers();
    wave_.lightSamples.setSampleOfAll(s);
    const std::uint64_t rays =
        takeLight(hidden, {LightStrategy::EveryPunctual}, receivers, wave_.lightSamples, 0, kGatherDensity, sampled);
    if (rays == 0) continue;
    counts.shadowRays += rays;
    sampled.trace(hidden.rays, TraceMode::Packet);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!sampled.found(lane)) continue;
      const Vec3 flat = sampled.light[lane] * (glm::dot(sampled.wi[lane], receivers.ns[lane]) * kInvPi);
      if (isFinite(flat)) texels[lane].hidden += flat / static_cast<float>(kWarmLights);
    }
  }
}

void WarmWave::traceRays(std::array<WarmPacket, kWarmRays>& packets) {
  SampleLanes samples = wave_.lightSamples;
  for (std::uint32_t s = 0; s < kWarmRays; ++s) {
    auto& [rays, lookup] = packets[s];
    samples.setSampleOfAll(s);
    const UnitSquareLanes u = samples.draw2D(kWarmDirection);
    // By the cosine every ray counts alike, so that no texel passes on more than it receives.
    aimCosineRays(u.x, u.y, wave_.points[s], rays);
    transport_.rays.intersect(rays.packet, TraceMode::Packet);
    for (std::size_t lane = wave_.count; lane < kLanes; ++lane) rays.packet.valid[lane] = 0;
    wave_.scene.map.findAll(rays.packet, lookup);
  }
}

/// Whether rays find the wide emitters so well that their light varies no more from ray to ray than that of other
/// surfaces does: its mean square is at most kMostSpread times the square of the mean of what shines by itself there.
bool WarmWave::raysFindWide(const std::array<WarmPacket, kWarmRays>& packets) const {
  double sum = 0.0, squares = 0.0, rays = 0.0;
  for (const WarmPacket& traced : packets)
    for (int lane = 0; lane < kLanes; ++lane) {
      const RayPacket& packet = traced.rays.packet;
      if (!packet.valid[lane]) continue;
      ++rays;
      if (!packet.hit(lane)) {
        if (transport_.environment.shines())
          sum += static_cast<double>(luminance(transport_.environment.radiance(packet.direction(lane))));
        continue;
      }
      if (transport_.rays.parts()[traced.lookup.parts[static_cast<std::size_t>(lane)]].firstEmitter < 0) continue;
      const HitSurface hit = transport_.rays.surfaceAt(packet, lane);
      if (!transport_.emissive.isWide(hit)) continue;
      const auto light = static_cast<double>(luminance(emittedTowardsRay(transport_.materials, hit)));
      sum += light;
      squares += light * light;
    }
  return squares > 0.0 && rays * squares <= kMostSpread * sum * sum;
}

std::array<WarmTexel, kLanes> WarmWave::warmUp(std::span<CacheLink> links, GatheredWave& counts) {
  std::array<WarmTexel, kLanes> texels;
  wave_.points.draw(wave_.samplers, kFootprint, 0, kWarmLights);
  // While one texel's memory is on its way, the one before is read.
  std::array<WarmAlbedos, 2> albedos;
  for (std::size_t lane = 0; lane <= wave_.count; ++lane) {
    if (lane < wave_.count && wave_.covered[lane]) findAlbedos(lane, albedos[lane % 2]);
    if (lane > 0 && wave_.covered[lane - 1]) texels[lane - 1].reflectance = meanReflectance(albedos[(lane - 1) % 2]);
  }
  std::array<WarmPacket, kWarmRays> packets;
  traceRays(packets);
  if (transport_.emissive.hasWide() && raysFindWide(packets)) transport_.sampled = Emitters::WithoutWide;
  warmDirect(texels, counts);
  if (transport_.hidden != nullptr) warmHidden(texels, counts);

  WarmSink sink{texels, links};
  GatherTracer tracer(transport_, wave_.scene.map, wave_.scene.reflectance, wave_.scene.lastDepth,
                      punctualChoice(transport_.punctual, {}, {}), sink);
  for (std::uint32_t s = 0; s < kWarmRays; ++s) {
    auto& [rays, lookup] = packets[s];
    forEachLane(lookup.near, [&](std::size_t lane) { texels[lane].nears |= 1u << s; });
    lookup.near = 0;  // links lead to texels
    Flight flight;
    tracer.arriveAll(rays.packet, lookup, [&](int lane) -> const Flight& {
      const auto l = static_cast<std::size_t>(lane);
      ++counts.rays;
      flight = wave_.flightOf(l, s, wave_.points[s], rays);
      flight.key = wave_.samplers[l].seedOf(kWarmHits);
      flight.beta = rays.packet.tint(l);
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

}  // namespace lumel
