// Work on primitives. What every loader does before one is handed on: degenerate triangles go, normals are made or
// repaired, vertices that nothing uses go.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace lumel {

/// Drops vertices that no triangle uses; the others keep their order.
void dropUnusedVertices(Primitive& primitive);

/// Rebuilds all vertex arrays so that vertex i is what vertex source[i] was. Indices are left alone.
void gatherVertices(Primitive& primitive, std::span<const std::uint32_t> source);

/// Drops degenerate triangles (a repeated index, or an area that is nothing beside the longest edge squared: a tiny one
/// stays) and unused vertices; makes flat normals where there are none, splitting vertices, and mends normals and
/// tangents that are zero or not finite; then makes MikkTSpace tangents if the material has a normal map and the file
/// gave none. Positions must be finite. Counts and warnings go to `report`.
void finishPrimitive(Primitive& primitive, const Material& material, LoadReport& report);

/// Per vertex: the first with the same position. Exact, so it is the same at any scale; -0 is 0.
std::vector<std::uint32_t> weldPositions(const std::vector<Vec3>& positions);

}  // namespace lumel
