// scene.glb of a bake: the input scene with its lightmap UVs, ready for any glTF 2.0 viewer.
#pragma once

#include <cstdint>
#include <vector>

#include "lightmap/surface.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

enum class SceneForm {
  Instances,  // meshes in their own space under nodes with transforms
  Flattened,  // every node has a mesh of its own in world space, UVs are those of pages
};

/// Encodes a binary glTF: one node per instance (name kept) whose primitives are the instance's surfaces, each with
/// TANGENT = the bake frame and TEXCOORD_1 = lightmap UVs, then the primitives without a lightmap. TEXCOORD_0 is the
/// source's set 0; a source set k >= 1 that the material reads becomes TEXCOORD_(k+1). Lights and cameras are nodes of
/// their own. A primitive with extras.lumel.page lies on that page; without one, on that of its node, if that has one.
/// Instances: extras.lumel of a node is {page, scale, offset}, page UV = TEXCOORD_1 * scale + offset. Instances whose
/// own UVs are used share their mesh; generated charts differ from instance to instance, so their meshes do too. A node
/// whose transform shears (not allowed in glTF) is written as if flattened.
/// The file is the pieces one after the other.
/// Errors: Failed (beyond the 4 GiB of a GLB, an image that cannot be encoded).
Expected<std::vector<std::vector<std::uint8_t>>> encodeGlb(const Scene& scene, const Atlas& atlas, SceneForm form);

}  // namespace lumel
