// The bake frame of every vertex: the material's tangents where it has them, else the lightmap's own directions.
#pragma once

#include <span>

#include "lightmap/surface.h"

namespace lumel {

/// Tangents that are further apart than this (5 degrees) break the frame: a consumer would see it.
inline constexpr float kSameFrameCos = 0.9962f;

/// Whether the primitive's material sets the frame: it gives tangents, from the file or made for a normal map.
bool hasMaterialFrame(const Primitive& primitive);

/// Sets Surface::tangents for the surfaces of one instance. Material tangents go to world space, a
/// mirroring instance turns their handedness over, so that b stays the transformed bitangent. Elsewhere t = dP/du and
/// b points up in the image, averaged by angle over the triangles of a chart around a point (its vertices may be split
/// by hard shading: all copies get one tangent, so that the frame has no break inside a chart).
void setBakeFrames(const Scene& scene, std::span<Surface> surfaces);

}  // namespace lumel
