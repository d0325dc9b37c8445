// Rays that end on the texel cache: a ray stops at the first surface whose texel knows what it reflects. Where a hit
// has no texel (a surface without lightmap, the back of a single-sided one) it is shaded on the spot: its direct light
// is sampled and one ray goes on, until it meets a texel. So is the first hit of a ray that is no longer than its
// texels are wide: in corners and at the feet of things one value for a whole texel would tell its neighbours the wrong
// light.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/direct_light.h"
#include "baker/light_transport.h"
#include "baker/sampling.h"
#include "baker/texel_cache.h"

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
};

/// Sink receives what rays find, in an order that depends on the rays alone:
///   light(flight, radiance, depth)   radiance that exists for bakes of `depth` indirect bounces and more
///   texel(flight, texel)             the flight ended on this texel
///   prefetch(texel)                  texel(...) will probably be called with it
///   backFace(flight)                 a gather ray met the back of a single-sided surface
template <class Sink>
class GatherTracer {
 public:
  /// Hits at depth `lastDepth` bring their own emission alone. `reflectance`: of the texels, where it is known; else
  /// empty. It is what the back of a surface with a lightmap reflects, as its front does.
  GatherTracer(const LightTransport& transport, const TexelMap& map, std::span<const Vec3> reflectance, int lastDepth,
               Sink& sink)
      : transport_(transport), map_(map), reflectance_(reflectance), lastDepth_(lastDepth), sink_(sink) {}

  /// What the rays of a packet found; flightOf(lane) tells of each.
  template <class FlightOf>
  void arriveAll(const RayPacket& packet, FlightOf flightOf) {
    TexelMap::Lookup lookup;
    map_.findAll(packet, lookup);
    for (const std::uint32_t texel : lookup.texels)
      if (texel != kNoTexel) sink_.prefetch(texel);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!packet.valid[lane]) continue;
      const Flight& flight = flightOf(lane);
      const std::uint32_t texel = lookup.texels[static_cast<std::size_t>(lane)];
      if (texel != kNoTexel && flight.depth < lastDepth_)
        sink_.texel(flight, texel);
      else
        arrive(packet, lane, flight);
    }
  }

  /// What a traced ray found. Precondition: packet.valid[lane].
  void arrive(const RayPacket& packet, int lane, const Flight& flight) {
    if (!packet.hit(lane)) {
      if (transport_.environment.shines())
        sink_.light(flight, transport_.environment.arriving(packet.direction(lane), flight.pdf), flight.depth);
      return;
    }
    const std::uint32_t part = transport_.rays.partOf(packet, lane);
    const bool emits = transport_.rays.parts()[part].firstEmitter >= 0;
    const std::uint32_t texel = flight.depth < lastDepth_ ? map_.find(part, packet, lane) : kNoTexel;
    if (!emits && texel != kNoTexel) {
      sink_.texel(flight, texel);
      return;
    }
    const HitSurface hit = transport_.rays.surfaceAt(packet, lane);
    if (flight.depth == 0 && hit.backFace && !transport_.materials.material(hit.material).doubleSided)
      sink_.backFace(flight);
    if (emits) {
      const Vec3 emitted = emittedTowardsRay(transport_.materials, hit);
      if (emitted != Vec3(0.0f))
        sink_.light(flight, emitted * misWeight(flight.pdf, transport_.emissive.pdf(hit, flight.origin)), flight.depth);
    }
    if (texel != kNoTexel)
      sink_.texel(flight, texel);
    else if (flight.depth < lastDepth_)
      leaveToShade(flight, packet, lane, albedoAt(part, packet, lane, hit.point));
  }

  /// In two steps: brings closer what shading the hit will read.
  void expectSpot(const RayPacket& packet, int lane) const { transport_.rays.prefetchIndices(packet, lane); }
  void expectSpot(const RayPacket& packet, int lane, std::uint32_t texel) const {
    transport_.rays.prefetchCorners(packet, lane);
    if (!reflectance_.empty() && texel != kNoTexel) __builtin_prefetch(&reflectance_[texel]);
  }

  /// Shades the hit on the spot, although it has a texel.
  void arriveNear(const RayPacket& packet, int lane, const Flight& flight, std::uint32_t texel) {
    leaveToShade(flight, packet, lane,
                 reflectance_.empty() ? transport_.materials.albedo(transport_.rays.pointAt(packet, lane))
                                      : reflectance_[texel]);
  }

  /// Follows what was left to be shaded on the spot, while it fills packets.
  void shadeFull() {
    while (spots_.size() >= kLanes) shade(kLanes);
  }
  /// Follows all.
  void finish() {
    while (!spots_.empty()) shade(std::min<std::size_t>(kLanes, spots_.size()));
  }

  std::uint64_t rays() const { return rays_; }
  std::uint64_t shadowRays() const { return shadowRays_; }

 private:
  struct Spot {
    Flight flight;  // beta includes the albedo
    HitCorners hit;
  };
  static constexpr int kRouletteAfter = 4;
  static constexpr std::uint32_t kDirection = kLightPatterns;
  static constexpr std::uint32_t kRoulette = kLightPatterns + 1;

  /// One sequence for all samples of a texel that are shaded after so many hits.
  static TexelSampler samplerAt(const Flight& flight) {
    return {flight.key, static_cast<std::uint32_t>(flight.depth), 0u, 0u};
  }

  Vec3 albedoAt(std::uint32_t part, const RayPacket& packet, int lane, const TrianglePoint& point) const {
    if (!reflectance_.empty())
      if (const std::uint32_t texel = map_.under(part, packet, lane); texel != kNoTexel) return reflectance_[texel];
    return transport_.materials.albedo(point);
  }

  void leaveToShade(const Flight& flight, const RayPacket& packet, int lane, const Vec3& albedo) {
    const float most = std::max({albedo.x, albedo.y, albedo.z});
    if (most == 0.0f) return;
    Vec3 beta = flight.beta * albedo;
    if (flight.depth >= kRouletteAfter) {
      const float survival = std::max(most, 0.05f);
      if (samplerAt(flight).get1D(flight.sample, kRoulette) >= survival) return;
      beta /= survival;
    }
    // Made in its place: a copy would wait for what was just written.
    Spot& spot = spots_.emplace_back();
    spot.flight = flight;
    spot.flight.beta = beta;
    transport_.rays.cornersAt(packet, lane, spot.hit);
  }

  /// The last `count` spots.
  void shade(std::size_t count) {
    HitCornerLanes hits;
    SampleLanes samples;
    std::array<Flight, kLanes> flights;
    std::array<std::uint32_t, kLanes> keys{}, depths{};
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Spot& spot = spots_[spots_.size() - count + lane];
      transport_.rays.set(hits, lane, spot.hit);
      flights[lane] = spot.flight;
      keys[lane] = spot.flight.key;
      depths[lane] = static_cast<std::uint32_t>(spot.flight.depth);
      samples.setSample(static_cast<int>(lane), spot.flight.sample);
    }
    samples.setTexels(keys.data(), depths.data());  // as samplerAt
    spots_.resize(spots_.size() - count);
    Vec3Lanes p, ng, ns, rayStart;
    receiveAt(hits, p, ng, ns, rayStart);
    const ReceiverLanes receivers{hits.active, p, ng, ns, rayStart};
    shadowRays_ += directLight(transport_, receivers, samples, 0, TraceMode::Packet, kCosineDensity,
                               [&](int lane, const Vec3& wi, const Vec3& light) {
                                 const auto l = static_cast<std::size_t>(lane);
                                 sink_.light(flights[l], light * (glm::dot(wi, ns[l]) * kInvPi), flights[l].depth + 1);
                               });
    alignas(64) float pdf[kLanes];
    aimByCosine(receivers, samples.draw2D(kDirection), packet_, pdf);
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (!packet_.valid[lane]) continue;
      ++flights[lane].depth;
      flights[lane].origin = p[lane];
      flights[lane].pdf = pdf[lane];
      ++rays_;
    }
    transport_.rays.intersect(packet_, TraceMode::Packet);
    arriveAll(packet_, [&](int lane) -> const Flight& { return flights[static_cast<std::size_t>(lane)]; });
  }

  const LightTransport& transport_;
  const TexelMap& map_;
  const std::span<const Vec3> reflectance_;
  const int lastDepth_;
  Sink& sink_;
  std::vector<Spot> spots_;
  RayPacket packet_;  // of rays that go on
  std::uint64_t rays_ = 0;
  std::uint64_t shadowRays_ = 0;
};

}  // namespace lumel
