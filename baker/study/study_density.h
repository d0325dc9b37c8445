// What another texel density shows at the places of given texels.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "baker/bake/bake.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

/// Looks up one parameterization of a scene at surface points of another, as a game does: bilinearly.
class AtlasLookup {
 public:
  /// `pages`: finished (holes filled, dilated). Keeps references.
  AtlasLookup(const Atlas& atlas, const std::vector<BakedPage>& pages);

  /// Flat light at a point of `other`, an atlas of the same scene; nothing where this one has not its triangle.
  std::optional<Vec3> flatAt(const Atlas& other, const SurfacePoint& point) const;

 private:
  const Atlas& atlas_;
  const std::vector<BakedPage>& pages_;
  std::vector<std::unordered_map<std::uint64_t, TriangleRef>> triangles_;  // per instance: by primitive and triangle
};

}  // namespace lumel
