// One wave of the warm-up: light samples at its texels, and a few rays that are kept as links to the texels that they
// found.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "baker/gather/waves/gather_sink.h"
#include "baker/gather/waves/wave_texels.h"

namespace lumel {

/// A link of the warm-up: one ray, and the texel that it found.
struct CacheLink {
  std::uint32_t texel = kNoTexel;
  std::uint32_t weight = 0;  // packWeight: red, green, blue in steps of 1/1023
};
std::uint32_t packWeight(const Vec3& weight);  // 0..1, clamped
Vec3 unpackWeight(std::uint32_t packed);

/// The start of the cache at one texel.
struct WarmTexel {
  Vec3 reflectance{0};      // mean over the texel
  Vec3 direct{0};           // irradiance / pi from light samples
  Vec3 hidden{0};           // the part of it that the maps leave out: of lamps in LightTransport::hidden
  Vec3 seen{0};             // the same from what rays see shine by itself
  Vec3 relit{0};            // the same from hits without texels: light of one bounce and more
  std::uint32_t backs = 0;  // bits of the rays that met backs
  std::uint32_t nears = 0;  // and of those that ended near (TexelMap::kNearTexels)

  /// Whether more than one of its rays ended near: part of it is shut away by what stands on it or close by, so that
  /// its mean is not what is seen of it. Not where it is wholly inside of something.
  bool isUneven() const;
};

class WarmWave {
 public:
  static constexpr int kWarmLights = 16;

  /// Texels [first, first + count) of a page, count <= kLanes.
  WarmWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count)
      : wave_(scene, page, first, count), transport_(scene.transport) {}

  /// `links`: kWarmRays per texel of the wave. Adds the rays that it traced to `counts`.
  std::array<WarmTexel, kLanes> warmUp(std::span<CacheLink> links, GatheredWave& counts);
  /// Returns which emitters light samples of the wave are to look for, after warmUp().
  Emitters sampled() const { return transport_.sampled; }

 private:
  /// The rays of all texels of one number, and what they hit.
  struct WarmPacket {
    AimedRays rays;
    TexelMap::Lookup lookup;
  };
  void traceRays(std::array<WarmPacket, kWarmRays>& packets);
  bool raysFindWide(const std::array<WarmPacket, kWarmRays>& packets) const;
  /// What a texel's reflectance is the mean of.
  struct WarmAlbedos {
    std::array<TrianglePoint, kWarmLights> points;
    std::array<Materials::AlbedoLookup, kWarmLights> lookups;
  };
  void findAlbedos(std::size_t lane, WarmAlbedos& albedos) const;
  Vec3 meanReflectance(const WarmAlbedos& albedos) const;
  float shareOf(const TriangleRef& triangle) const;
  TrianglePoint sourceOf(const PlaceOnTriangle& place) const;
  void warmDirect(std::array<WarmTexel, kLanes>& texels, GatheredWave& counts);
  void warmHidden(std::array<WarmTexel, kLanes>& texels, GatheredWave& counts);

  WaveTexels wave_;
  LightTransport transport_;
};

}  // namespace lumel
