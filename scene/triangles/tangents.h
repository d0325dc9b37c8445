// Tangents compatible with MikkTSpace: Morten S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", thesis,
// University of Copenhagen 2008, chapter 4: tangents that a vertex's neighbourhood agrees on, that do not depend on
// the order of triangles or vertices, and that baking tools share, so that a normal map decodes as it was made.
// Computed on triangles, as glTF asks. A tool that ran on quads before it triangulated has other averages; such a
// file should bring its own TANGENT.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/scene.h"

namespace lumel {

/// One tangent per corner (three per triangle): xyz unit and perpendicular to the corner's normal, pointing where u
/// grows; w = +-1, so that w * cross(n, t) points where the image's v *decreases* (glTF's v runs down, green is up).
/// Corners share a tangent if position, normal and UV agree and their triangles hang together around the vertex
/// with the same winding in UV space: mirrored islands never mix. Where UVs have no area, a direction of the
/// neighbours, or else an arbitrary one (frameAround) with w = 1.
std::vector<Vec4> cornerTangents(std::span<const Vec3> positions, std::span<const Vec3> normals,
                                 std::span<const Vec2> uvs, std::span<const std::uint32_t> indices);

/// Gives the primitive tangents from UV set `uvSet` after uvMatrix (the frame in which the map is seen), and splits
/// vertices whose corners differ.
void makeTangents(Primitive& primitive, std::size_t uvSet, const Mat3& uvMatrix);

}  // namespace lumel
