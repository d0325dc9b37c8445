// The glTF node tree, flattened: instances (with EXT_mesh_gpu_instancing), lights, cameras, and which meshes are
// wanted in which form. Private to scene/gltf_*.cpp.
#pragma once

#include <vector>

#include "scene/gltf/gltf_document.h"
#include "scene/gltf/gltf_mesh.h"
#include "scene/scene.h"

namespace lumel {

/// Appends instances, lights and cameras of the default scene (`scene`, else scene 0, else all root nodes) to
/// `scene`, depth first in file order. Instance::mesh is an index into the returned uses.
/// Errors: a node that is its own ancestor or has two parents, a transform that overflows, bad extras.lumel.
Expected<std::vector<MeshUse>> flattenNodes(const GltfDocument& document, Scene& scene);

}  // namespace lumel
