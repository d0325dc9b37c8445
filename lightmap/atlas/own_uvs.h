// Rectangles for lightmap UVs that are each object's own: TEXCOORD_1 as modelling tools unwrap an object by itself.
#pragma once

#include "lightmap/atlas/assemble.h"
#include "lightmap/charts/unwrap.h"
#include "scene/scene.h"

namespace lumel {

/// The box around an object's UVs and how many texels it asks for along each axis.
struct OwnUvs {
  Vec2d low{0.0};  // of the UVs
  Vec2d high{0.0};
  Vec2d texelsPerUv{1.0};

  Vec2d size() const { return (high - low) * texelsPerUv; }  // in texels
};

/// The rectangle has as many texels as the surface at `texelsPerMeter`. Its sides are in the mean proportion in which
/// the UVs stretch the surface: the geometric mean over the surface, so that slivers do not decide.
/// Every receiving primitive has a TEXCOORD_1 with area.
OwnUvs measureOwnUvs(const Scene& scene, const Instance& instance, double texelsPerMeter);

/// The box as one chart of two triangles, for packing; `triangles` of the object belong to it.
Unwrapped boxChart(const OwnUvs& own, std::size_t triangles);

/// How well charts of an object's own UVs are kept apart on its page.
struct OwnMargins {
  double shared = 0.0;   // texels that hold places of two charts
  double covered = 0.0;  // texels
  bool touch = false;    // texels of two charts lie side by side: bilinear lookups mix them
};

/// Looks at the texels of one instance on its page. `triangles` of one page of `pageSize` texels.
OwnMargins measureMargins(std::span<const PlacedTriangle> triangles, const Vec2d& pageSize);

}  // namespace lumel
