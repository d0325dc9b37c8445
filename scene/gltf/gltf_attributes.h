// Vertex attributes and indices of one glTF primitive, from accessors or Draco, with morph targets and skin applied.
// Private to scene/gltf_*.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/gltf/gltf_document.h"
#include "scene/gltf/gltf_mesh.h"

namespace lumel {

/// Fills the vertex arrays of `primitive` and returns its indices (made up where the file has none), each checked
/// against the vertex count. `place` is the primitive's JSON place. A primitive without POSITION has no vertices.
Expected<std::vector<std::uint32_t>> readAttributes(const GltfDocument& document, const tinygltf::Primitive& source,
                                                    const std::string& place, const MeshUse& use, Primitive& primitive,
                                                    LoadReport& report);

}  // namespace lumel
