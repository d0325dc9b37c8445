// What surfaces send back, as the gather knew it in the end: for whatever asks for light after it, points in space and
// pictures.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "baker/gather/waves/gather_scene.h"
#include "baker/gather/waves/packed_color.h"
#include "baker/gather/waves/texel_map.h"

namespace lumel {

/// Keeps references to the ray scene, the atlas and the texels that the gather was made with.
struct SurfaceCache {
  TexelMap map;
  CacheLevels levels{};
  int bounces = 0;                       // of the bake; negative: all that matter
  int lastDepth = 0;                     // GatherTracer
  std::vector<PackedColor> reflectance;  // per texel; empty for a bake of no bounces
  std::vector<PackedColor> radiance;     // that the texel reflects: levels.count each

  /// Radiance that a texel sends back, by the front: with all bounces but the last, so that whoever gathers it has the
  /// bounces of the bake. Zero for a bake of no bounces.
  Vec3 reflectedBy(std::uint32_t texel) const {
    const int level = levels.count > 0 ? levels.read(bounces, 0) : -1;
    if (level < 0) return Vec3(0.0f);
    return unpackColor(
        radiance[std::size_t{texel} * static_cast<std::size_t>(levels.count) + static_cast<std::size_t>(level)]);
  }
  /// The same at what a lane of a traced packet hit, found by map.findAll(packet, lookup). Nothing where the texel does
  /// not know: nothing was hit, the surface has no lightmap or is seen from behind, or one value for the texel is too
  /// coarse. What the surface sends out by itself is not part of it.
  std::optional<Vec3> radianceAt(const TexelMap::Lookup& lookup, std::size_t lane) const {
    const std::uint32_t texel = lookup.texels[lane];
    const std::uint32_t unknown = lookup.behind | lookup.near | lookup.uneven;
    if (texel == kNoTexel || (unknown >> lane & 1u) != 0) return std::nullopt;
    return reflectedBy(texel);
  }
};

}  // namespace lumel
