// One wave of a gather pass: up to 16 neighbouring texels send the rays of one pass in step.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/gather/waves/gather_sink.h"
#include "baker/gather/waves/near_texels.h"
#include "baker/gather/waves/wave_texels.h"

namespace lumel {

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

class GatherWave {
 public:
  /// Texels [first, first + count) of a page, count <= kLanes.
  /// Light samples look for the emitters `sampled`, which must not depend on samples of the gather.
  GatherWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count,
             Emitters sampled = Emitters::All);

  /// Share of the texel's area that is covered, 0..1.
  float coverage(std::size_t lane) const { return static_cast<float>(std::min(wave_.points.area(lane), 1.0)); }

  /// Samples [first, end) of every covered texel. `cache`: levels.count values per texel of the map, the radiance
  /// that the texel reflects. `buried`: one per texel of the wave; nothing is gathered for those. `places`: the
  /// same, their places' light (GatherState::places), which `spreads` weigh by; empty: all are of one place. `spreads`:
  /// what the wave remembers of its light from pass to pass: of each of GatherScene::strategies, and last of the gather
  /// rays; empty without strategies. `result`: empty before.
  void gather(std::uint32_t first, std::uint32_t end, std::span<const PackedColor> cache,
              std::span<const std::uint8_t> buried, std::span<const float> places, std::span<LightSpread> spreads,
              GatheredWave& result);

 private:
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

  WaveTexels wave_;
  LightTransport transport_;  // of what its rays hit
  NearTexels near_;
  std::size_t coveredCount_ = 0;
  std::vector<LightTally> lightTallies_;  // of the strategies
  NetLanes net_;
  CoherencePilot pilot_;
  static constexpr std::uint32_t kInFlight = 4;
  std::array<Packet, kInFlight> packets_;
};

}  // namespace lumel
