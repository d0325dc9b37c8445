// scene.glb of a bake: the input scene with its lightmap UVs, ready for any glTF 2.0 viewer.
#pragma once

#include <cstdint>
#include <vector>

#include "lightmap/surface.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// Encodes a binary glTF: one node per instance (name kept, geometry in world space) whose primitives are the
/// instance's surfaces, each with TANGENT = the bake frame, TEXCOORD_1 = lightmap UVs and extras.lumel.page, then the
/// primitives without a lightmap, without extras. TEXCOORD_0 is the source's set 0; a source set k >= 1 that the
/// material reads becomes TEXCOORD_(k+1). Lights and cameras are nodes of their own.
/// The file is the pieces one after the other.
/// Errors: Failed (beyond the 4 GiB of a GLB, an image that cannot be encoded).
Expected<std::vector<std::vector<std::uint8_t>>> encodeGlb(const Scene& scene, const Atlas& atlas);

}  // namespace lumel
