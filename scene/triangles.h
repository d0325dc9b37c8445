// Work on primitives. What every loader does before one is handed on: degenerate triangles go, normals are made or
// repaired, vertices that nothing uses go.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace lumel {

/// Drops triangles with a repeated index, or whose area is nothing beside the square of their longest edge (a
/// relative criterion: a tiny triangle stays). Positions must be finite. Returns how many went.
std::size_t dropDegenerateTriangles(Primitive& primitive);

/// Flat normals as glTF 2.0 asks for where a mesh has none: each triangle gets its own, vertices are split where
/// their triangles differ. Needs a primitive without degenerate triangles; drops any tangents.
void makeFlatNormals(Primitive& primitive);

/// Makes normals unit length; those that are zero or not finite become the area-weighted mean of their triangles'.
/// Returns how many were replaced.
std::size_t repairNormals(Primitive& primitive);

/// The same for tangents: unit xyz, w = +-1; a useless one becomes any direction perpendicular to the normal.
std::size_t repairTangents(Primitive& primitive);

/// Drops vertices that no triangle uses; the others keep their order.
void dropUnusedVertices(Primitive& primitive);

/// Rebuilds all vertex arrays so that vertex i is what vertex source[i] was. Indices are left alone.
void gatherVertices(Primitive& primitive, std::span<const std::uint32_t> source);

/// All of the above in order, then MikkTSpace tangents if the material has a normal map and the file gave none.
/// Counts and warnings go to `report`.
void finishPrimitive(Primitive& primitive, const Material& material, LoadReport& report);

/// Per vertex: the first with the same position. Exact, so it is the same at any scale; -0 is 0.
std::vector<std::uint32_t> weldPositions(const std::vector<Vec3>& positions);

}  // namespace lumel
