// The geometry of one instance as scene.glb holds it: in the object's own space under its node, or in the world.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/surface.h"
#include "scene/scene.h"

namespace lumel {

/// One primitive of a mesh in scene.glb. Vertex arrays have one entry per vertex; tangents and lightmapUvs may be
/// empty.
struct GlbPart {
  int primitive = 0;  // of the source mesh
  int page = -1;      // of its lightmap; -1: none
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  std::vector<Vec2> lightmapUvs;
  std::vector<std::uint32_t> sourceVertex;  // into the source primitive
  std::vector<std::uint32_t> indices;
};

/// Whether the node of an instance can state its transform: glTF wants matrices without shear.
bool isNodeTransform(const Mat4& worldFromObject);

/// The instance's `surfaces` and then its primitives without a lightmap, in world space, with page UVs.
std::vector<GlbPart> partsInWorld(const Scene& scene, const Instance& instance, std::span<const Surface> surfaces);

/// The same in the object's space, vertices in the order of the source. `ownUvs`: with the TEXCOORD_1 that the object
/// came with; else with page UVs.
std::vector<GlbPart> partsInObject(const Scene& scene, const Instance& instance, std::span<const Surface> surfaces,
                                   bool ownUvs);

/// Whether two instances of one mesh look the same in the object's space, but for the pages of their lightmaps. Frames
/// of the bake may differ by what rounding in the world leaves.
bool sameButForPages(std::span<const GlbPart> a, std::span<const GlbPart> b);

}  // namespace lumel
