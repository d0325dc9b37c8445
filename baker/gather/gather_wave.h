// One wave of a gather pass: up to 16 neighbouring texels send the rays of one pass in step.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baker/gather/gather_kernels.h"
#include "baker/gather/gather_tracer.h"
#include "baker/gather/inside_points.h"
#include "baker/gather/light_effort.h"
#include "baker/gather/wave_points.h"
#include "baker/rays/non_finite.h"
#include "baker/rays/stratified_net.h"
#include "lightmap/maps/projection.h"
#include "lightmap/maps/projection_probe.h"

namespace lumel {

/// The light that the cache holds for every texel, by number of bounces. Level l holds light after base + l bounces;
/// a bake of N bounces reads N - 1. `endless`: one level, which holds all bounces and is read by itself.
struct CacheLevels {
  static constexpr int kMost = 8;
  int count = 0;  // levels stored; 0: nothing is looked up
  int base = 0;
  bool endless = false;

  /// Level that a gather of `bounces` reads after `depth` more hits; -1: none.
  int read(int bounces, int depth) const {
    if (endless) return 0;
    const int level = bounces - 1 - depth - base;
    // Below the lowest level that is kept the light of a few bounces more stands in.
    return level >= 0 ? level : (base > 0 ? 0 : -1);
  }
};

/// What every wave reads.
struct GatherScene {
  const LightTransport& transport;
  const RnmKernels& kernels;
  const Atlas& atlas;
  const std::vector<PageTexels>& texels;
  const TexelMap& map;
  std::uint64_t seed = 1;
  int bounces = 0;    // of the result; with endless levels unused
  int lastDepth = 0;  // GatherTracer
  CacheLevels levels{};
  bool indirectOnly = false;
  std::optional<TraceMode> gatherMode{};       // of the texels' rays; else as CoherencePilot says
  std::vector<LightStrategy> strategies{};     // of the texels' own light
  std::span<const PackedColor> reflectance{};  // of the map's texels, once the warm-up has found it
};

/// Chooses how the next packet is traced by what those before it hit: where many rays of a packet find the triangle
/// that their neighbour found they run through the same nodes too, and Embree's coherent traversal takes less time;
/// where they scatter it takes more. Hits are the same either way, but for which of two surfaces in the same place is
/// found, and the choice depends on the scene and not on clocks.
class CoherencePilot {
 public:
  explicit CoherencePilot(const RayScene& rays) : allowed_(!rays.placesInstances()) {}

  TraceMode mode() const { return allowed_ && changes_ <= kMemory * kFew ? TraceMode::Coherent : TraceMode::Packet; }
  void see(const RayPacket& traced) { changes_ += differentNeighbours(traced) - changes_ / kMemory; }

 private:
  static constexpr int kMemory = 4;  // packets
  static constexpr int kFew = 10;
  bool allowed_;
  int changes_ = kMemory * kLanes;  // times kMemory
};

/// What the texels of a wave gathered in one pass: sums over its samples.
struct GatheredTexel {
  Vec3d flat{0};
  std::array<Vec3d, 3> rnm{Vec3d(0), Vec3d(0), Vec3d(0)};
  std::array<Vec3d, CacheLevels::kMost> levels{};  // flat light of the cache's levels, unless endless
  std::array<Vec3d, kProbeNormals> probes{};       // where the texel is probed
  Vec3d seen{0};  // with GatherScene::indirectOnly: flat light from what rays see shine by itself, not in the maps
  std::uint32_t backFaces = 0;   // rays that met backs
  std::uint32_t firstBacks = 0;  // bits of the first kWarmRays samples, each from a point of its own
  InsideTally inside;            // of nets with two rays and more from each point
};

struct GatheredWave {
  std::array<GatheredTexel, kLanes> texels;
  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::vector<NonFiniteSample> nonFinite;
};

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
  Vec3 seen{0};             // the same from what rays see shine by itself
  Vec3 relit{0};            // the same from hits without texels: light of one bounce and more
  std::uint32_t backs = 0;  // bits of the rays that met backs
  std::uint32_t nears = 0;  // and of those that ended near (TexelMap::kNearTexels)

  /// Whether more than one of its rays ended near: part of it is shut away by what stands on it or close by, so that
  /// its mean is not what is seen of it. Not where it is wholly inside of something.
  bool isUneven() const;
};

struct GatherSink;

class GatherWave {
 public:
  static constexpr int kWarmRays = 8;
  static constexpr int kWarmLights = 16;

  /// Texels [first, first + count) of a page, count <= kLanes.
  GatherWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count);

  /// Share of the texel's area that is covered, 0..1.
  float coverage(std::size_t lane) const { return static_cast<float>(std::min(points_.area(lane), 1.0)); }

  /// `links`: kWarmRays per texel of the wave.
  std::array<WarmTexel, kLanes> warmUp(std::span<CacheLink> links, GatheredWave& counts);

  /// Samples [first, end) of every covered texel. `cache`: levels.count values per texel of the map, the radiance
  /// that the texel reflects. `buried`: one per texel of the wave; nothing is gathered for those. `spreads`: what
  /// the wave remembers of its light from pass to pass: of each of GatherScene::strategies, and last of the gather rays;
  /// empty without strategies. `result`: empty before.
  void gather(std::uint32_t first, std::uint32_t end, std::span<const PackedColor> cache,
              std::span<const std::uint8_t> buried, std::span<LightSpread> spreads, GatheredWave& result);

 private:
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
  Flight flightOf(std::size_t lane, std::uint32_t sample, const PointLanes& from, const AimedRays& rays) const;
  void gatherLight(const NetRange& net, std::span<LightSpread> spreads, GatherSink& sink);
  void sampleStrategy(std::size_t strategy, std::uint32_t first, std::uint32_t end, float weight, bool pilot,
                      GatherSink& sink);
  void gatherRays(const NetRange& net, GatherTracer<GatherSink>& tracer, GatherSink& sink);
  /// A packet of gather rays, from its start to where the light of its texels is known.
  struct Packet {
    std::uint32_t cell = 0;  // of the net
    AimedRays rays;
    TexelMap::Lookup lookup;
  };
  void launch(Packet& packet);
  static void expectSpots(const Packet& packet, const GatherTracer<GatherSink>& tracer);
  static void expectLight(const Packet& packet, const GatherTracer<GatherSink>& tracer, const GatherSink& sink);
  void collect(const Packet& packet, GatherTracer<GatherSink>& tracer, GatherSink& sink) const;
  void collectSky(const AimedRays& rays, std::uint32_t lanes, Vec3Lanes& light, GatherSink& sink) const;

  const GatherScene& scene_;
  std::uint32_t page_;
  std::size_t first_;
  std::size_t count_;
  WavePoints points_;
  std::array<TexelSampler, kLanes> samplers_;
  std::array<bool, kLanes> covered_{};
  std::size_t coveredCount_ = 0;
  SampleLanes lightSamples_;
  std::vector<LightTally> lightTallies_;  // of the strategies
  NetLanes net_;
  CoherencePilot pilot_;
  static constexpr std::uint32_t kInFlight = 4;
  std::array<Packet, kInFlight> packets_;
};

}  // namespace lumel
