// What the geometry of a bake says of the texels of its pages: which chart each belongs to, and how its bake frame lies
// in the world. Both come from scene.glb alone, so that an export needs no more than the folder of a bake.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "baker/files/read/baked_scene.h"
#include "lightmap/formats/chart_mips.h"
#include "scene/base/math.h"

namespace lumel {

/// Charts and coverage of each page. Triangles of an object whose corners have the same lightmap UVs are of one chart.
/// A texel counts by its coverage (channel coverage of aux), and next to nothing where it is not valid. Texels that
/// maps were dilated to, by bakeJson, are kept, too. `baked` has aux images.
std::vector<ChartTexels> chartTexels(const BakedScene& baked, const nlohmann::ordered_json& bakeJson);

/// Frames in the world by texel, row by row; only where `isKnown`.
struct PageFrames {
  std::vector<Frame> frames;
  std::vector<std::uint8_t> isKnown;
};

/// At the middle of each texel that a triangle touches, or at the point of the triangle that is nearest to it.
PageFrames pageFrames(const BakedScene& baked, std::size_t page);

}  // namespace lumel
