// What a gather reads: the scene, its texels, and how many bounces of light the cache holds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baker/gather/waves/packed_color.h"
#include "baker/gather/waves/texel_map.h"
#include "baker/gather/waves/waves.h"
#include "baker/light/direct_light.h"
#include "baker/light/light_transport.h"
#include "baker/rays/texel_parts.h"
#include "lightmap/maps/encoding.h"

namespace lumel {

/// Rays of the warm-up from every texel.
inline constexpr int kWarmRays = 8;

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

/// A texel that lies in several places, numbered as in TexelMap, and its points of which all that is known of it holds;
/// of the seed that its footprint pattern has.
struct DividedTexel {
  std::uint32_t texel = 0;
  PartPoints points;
};

/// What every wave reads, and what stays the same from pass to pass.
struct GatherScene {
  const LightTransport& transport;
  const Encoding& encoding;
  const Atlas& atlas;
  const std::vector<PageTexels>& texels;
  const TexelMap& map;
  const Waves& waves;
  std::uint64_t seed = 1;
  int bounces = 0;    // of the result; with endless levels unused
  int lastDepth = 0;  // GatherTracer
  CacheLevels levels{};
  bool indirectOnly = false;
  std::optional<TraceMode> gatherMode{};       // of the texels' rays; else as CoherencePilot says
  std::vector<LightStrategy> strategies{};     // of the texels' own light
  std::span<const DividedTexel> divided{};     // in order of texels, once they are known
  std::span<const PackedColor> reflectance{};  // of the map's texels, once the warm-up has found it

  /// Those of the texels [first, first + count).
  std::span<const DividedTexel> dividedAmong(std::size_t first, std::size_t count) const {
    const auto from = std::ranges::lower_bound(divided, first, {}, &DividedTexel::texel);
    const auto to = std::ranges::lower_bound(from, divided.end(), first + count, {}, &DividedTexel::texel);
    return {from, to};
  }

  /// Tells whether texels reflect light that is not in their maps: that of the warm-up's light samples stands for it.
  bool leavesLightOut() const { return indirectOnly || transport.hidden != nullptr; }

  /// Levels of the cache, as the length of a row.
  std::size_t stored() const { return static_cast<std::size_t>(levels.count); }
};

}  // namespace lumel
