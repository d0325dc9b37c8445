// Rays that end on the texel cache: a ray stops at the first surface whose texel knows what it reflects. Where a hit
// has no texel (a surface without lightmap, the back of a single-sided one) it is shaded on the spot: its direct light
// is sampled and one ray goes on, until it meets a texel. So is a hit for which one value for a whole texel is too
// coarse: one that is closer than a texel is wide, and one on a texel that something stands on or close by.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/waves/packed_color.h"
#include "baker/gather/waves/texel_map.h"
#include "baker/light/direct_light.h"
#include "baker/light/light_transport.h"
#include "baker/rays/sampling.h"

namespace lumel {

/// A ray on its way, and the gather ray that it belongs to.
struct Flight {
  std::uint32_t lane = 0;  // the texel of the wave that gathers
  std::uint32_t sample = 0;
  std::uint32_t key = 0;  // of the texel: seeds the choices made at hits
  int depth = 0;          // hits between the texel and this ray's start
  Vec3 dirTangent{0};     // of the gather ray
  Vec3 beta{0};           // weight of the radiance that this ray finds
  Vec3 origin{0};         // the surface point, before its offset
  float pdf = 0.0f;       // with which this ray's direction would be gathered, for the weight against light samples
  float chance = 0.0f;    // uniform in [0, 1), of rays from hits: decides the roulette where this one ends
};

/// Sink receives what rays find, in an order that depends on the rays alone:
///   light(flight, radiance, depth)   radiance that exists for bakes of `depth` indirect bounces and more
///   texel(flight, texel)             the flight ended on this texel
///   prefetch(texel)                  texel(...) will probably be called with it
///   backFace(flight)                 a gather ray met the back of a single-sided surface
template <class Sink>
class GatherTracer {
 public:
  /// Hits choose among punctual lights as `punctual` says. Hits at depth `lastDepth` bring their own emission alone.
  /// `reflectance`: of the texels, where it is known; else empty. It is what the back of a surface with a lightmap
  /// reflects, as its front does.
  GatherTracer(const LightTransport& transport, const TexelMap& map, std::span<const PackedColor> reflectance,
               int lastDepth, PunctualChoice punctual, Sink& sink)
      : transport_(transport),
        map_(map),
        reflectance_(reflectance),
        lastDepth_(lastDepth),
        punctual_(std::move(punctual)),
        sink_(sink) {
    spots_.reserve(kManySpots + kLanes);
  }

  /// From now on hits choose among punctual lights as `punctual` says, which must not have been learnt from hits.
  void choosePunctual(PunctualChoice punctual) { punctual_ = std::move(punctual); }

  /// What the rays of a packet found; flightOf(lane) tells of each.
  template <class FlightOf>
  void arriveAll(const RayPacket& packet, const TexelMap::Lookup& lookup, FlightOf flightOf) {
    for (const std::uint32_t texel : lookup.texels)
      if (texel != kNoTexel) sink_.prefetch(texel);
    for (int lane = 0; lane < kLanes; ++lane)
      if (packet.valid[lane]) arrive(packet, lane, flightOf(lane), lookup);
  }

  /// What a traced ray found. Precondition: packet.valid[lane].
  void arrive(const RayPacket& packet, int lane, const Flight& flight, const TexelMap::Lookup& lookup) {
    if (!packet.hit(lane)) {
      if (transport_.environment.shines())
        sink_.light(flight, transport_.environment.arriving(packet.direction(lane), flight.pdf), flight.depth);
      return;
    }
    const bool behind = (lookup.behind >> lane & 1u) != 0;
    const std::uint32_t texel = lookup.texels[static_cast<std::size_t>(lane)];
    if ((lookup.others >> lane & 1u) != 0) {
      const ScenePart& part = transport_.rays.parts()[lookup.parts[static_cast<std::size_t>(lane)]];
      if (flight.depth == 0 && behind && !part.doubleSided) sink_.backFace(flight);
      if (part.firstEmitter >= 0) findEmission(packet, lane, flight);
    }
    if (flight.depth >= lastDepth_) return;
    const bool tooCoarse = ((lookup.near | lookup.uneven) >> lane & 1u) != 0;
    if (texel != kNoTexel && !behind && !tooCoarse)
      sink_.texel(flight, texel);
    else
      leaveToShade(flight, packet, lane, albedoOf(packet, lane, lookup));
  }

  /// In two steps: brings closer what shading the hit will read.
  void expectPlace(const RayPacket& packet, const TexelMap::Lookup& lookup, std::size_t lane) const {
    transport_.rays.prefetchIndices(lookup.parts[lane], packet.rayhit.hit.primID[lane]);
  }
  void expectSpot(const RayPacket& packet, const TexelMap::Lookup& lookup, std::size_t lane) const {
    transport_.rays.prefetchCorners(lookup.parts[lane], packet.rayhit.hit.primID[lane]);
    const std::uint32_t texel = lookup.texels[lane];
    if (!reflectance_.empty() && texel != kNoTexel) __builtin_prefetch(&reflectance_[texel]);
  }

  /// One step with what was left to be shaded on the spot, once it fills packets: these are traced, and what their rays
  /// find is looked up, each step asking memory for what the next one reads.
  void advance() {
    do {
      step();
    } while (spots_.size() >= kManySpots);
  }
  /// Follows all.
  void finish() {
    while (stage_ != Stage::Idle || spots_.size() >= kLanes) step();
    while (!spots_.empty()) {
      shade(std::min<std::size_t>(kLanes, spots_.size()));
      while (stage_ != Stage::Idle) step();
    }
  }

  std::uint64_t rays() const { return rays_; }
  std::uint64_t shadowRays() const { return shadowRays_; }

 private:
  struct Spot {
    Flight flight;  // beta includes the albedo
    HitCorners hit;
  };
  enum class Stage { Idle, Traced, Placed, Found };
  static constexpr std::size_t kManySpots = 2 * kLanes;
  /// In gaps between things rays meet near hits again and again.
  static constexpr int kRouletteAfter = 1;
  static constexpr std::uint32_t kDirection = kLightPatterns;
  static constexpr std::uint32_t kRoulette = kLightPatterns + 1;

  void findEmission(const RayPacket& packet, int lane, const Flight& flight) {
    const HitSurface hit = transport_.rays.surfaceAt(packet, lane);
    const Vec3 emitted = emittedTowardsRay(transport_.materials, hit);
    if (emitted != Vec3(0.0f))
      sink_.light(flight, emitted * misWeight(flight.pdf, transport_.emitterPdf(hit, flight.origin)), flight.depth);
  }

  /// Of a hit to be shaded. Textures are not read where the texel knows their mean. Without them the material tells
  /// better: what a texel holds beside a thing that stands on it may differ from what is under it.
  Vec3 albedoOf(const RayPacket& packet, int lane, const TexelMap::Lookup& lookup) const {
    const auto l = static_cast<std::size_t>(lane);
    const ScenePart& part = transport_.rays.parts()[lookup.parts[l]];
    if (part.albedo) return *part.albedo;
    if (reflectance_.empty() || lookup.texels[l] == kNoTexel)
      return transport_.materials.albedo(transport_.rays.pointAt(packet, lane));
    return unpackColor(reflectance_[lookup.texels[l]]);
  }

  void leaveToShade(const Flight& flight, const RayPacket& packet, int lane, const Vec3& albedo) {
    const float most = std::max({albedo.x, albedo.y, albedo.z});
    if (most == 0.0f) return;
    Vec3 beta = flight.beta * albedo;
    if (flight.depth >= kRouletteAfter) {
      const float survival = std::max(most, 0.05f);
      if (flight.chance >= survival) return;
      beta /= survival;
    }
    // Made in its place: a copy would wait for what was just written.
    Spot& spot = spots_.emplace_back();
    spot.flight = flight;
    spot.flight.beta = beta;
    transport_.rays.cornersAt(packet, lane, spot.hit);
  }

  void step() {
    switch (stage_) {
      case Stage::Idle:
        if (spots_.size() >= kLanes) shade(kLanes);
        break;
      case Stage::Traced:
        map_.findPixels(packet_, lookup_);
        forEachLane(lookup_.others | lookup_.near, [&](std::size_t lane) { expectPlace(packet_, lookup_, lane); });
        stage_ = Stage::Placed;
        break;
      case Stage::Placed:
        map_.findTexels(lookup_);
        for (const std::uint32_t texel : lookup_.texels)
          if (texel != kNoTexel) sink_.prefetch(texel);
        forEachLane(lookup_.others | lookup_.near | lookup_.uneven,
                    [&](std::size_t lane) { expectSpot(packet_, lookup_, lane); });
        stage_ = Stage::Found;
        break;
      case Stage::Found:
        for (int lane = 0; lane < kLanes; ++lane)
          if (packet_.valid[lane]) arrive(packet_, lane, flights_[static_cast<std::size_t>(lane)], lookup_);
        stage_ = Stage::Idle;
        break;
    }
  }

  /// The last `count` spots. Precondition: no rays are under way.
  void shade(std::size_t count) {
    HitCornerLanes hits;
    SampleLanes samples;
    std::array<std::uint32_t, kLanes> keys{}, depths{};
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Spot& spot = spots_[spots_.size() - count + lane];
      transport_.rays.set(hits, lane, spot.hit);
      flights_[lane] = spot.flight;
      keys[lane] = spot.flight.key;
      depths[lane] = static_cast<std::uint32_t>(spot.flight.depth);
      samples.setSample(static_cast<int>(lane), spot.flight.sample);
    }
    // One sequence for all samples of a texel that are shaded after so many hits.
    samples.setTexels(keys.data(), depths.data());
    spots_.resize(spots_.size() - count);
    Vec3Lanes p, ng, ns, rayStart;
    receiveAt(hits, p, ng, ns, rayStart);
    const ReceiverLanes receivers{hits.active, p, ng, ns, rayStart};
    shadowRays_ += directLight(
        transport_, receivers, samples, 0, TraceMode::Packet, kCosineDensity,
        [&](int lane, const Vec3& wi, const Vec3& light) {
          const auto l = static_cast<std::size_t>(lane);
          sink_.light(flights_[l], light * (glm::dot(wi, ns[l]) * kInvPi), flights_[l].depth + 1);
        },
        punctual_.learnt.isUseful() ? &punctual_ : nullptr);
    alignas(64) float pdf[kLanes];
    aimByCosine(receivers, samples.draw2D(kDirection), packet_, pdf);
    const UnitLanes chances = samples.draw1D(kRoulette);
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (!packet_.valid[lane]) continue;
      ++flights_[lane].depth;
      flights_[lane].origin = p[lane];
      flights_[lane].pdf = pdf[lane];
      flights_[lane].chance = chances.u[lane];
      ++rays_;
    }
    transport_.rays.intersect(packet_, TraceMode::Packet);
    if (packet_.tinted != 0)
      forEachLane(packet_.tinted, [&](std::size_t lane) { flights_[lane].beta *= packet_.passed[lane]; });
    map_.findTriangles(packet_, lookup_);
    stage_ = Stage::Traced;
  }

  const LightTransport& transport_;
  const TexelMap& map_;
  const std::span<const PackedColor> reflectance_;
  const int lastDepth_;
  PunctualChoice punctual_;
  Sink& sink_;
  std::vector<Spot> spots_;  // left to be shaded
  // Rays that go on, and what is known of where they ended.
  Stage stage_ = Stage::Idle;
  RayPacket packet_;
  TexelMap::Lookup lookup_;
  std::array<Flight, kLanes> flights_;
  std::uint64_t rays_ = 0;
  std::uint64_t shadowRays_ = 0;
};

}  // namespace lumel
