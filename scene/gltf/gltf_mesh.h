// glTF meshes to plain primitives: attributes, triangle modes, morph targets, skins. Private to scene/gltf_*.cpp.
#pragma once

#include <optional>
#include <vector>

#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// A mesh as one or more instances use it. Morph weights, a skin or a flattening node make a mesh of their own.
struct MeshUse {
  int mesh = 0;
  std::vector<double> weights{};          // of the node; empty: the mesh's own
  std::vector<Mat4> jointMatrices{};      // world from bind pose; empty: no skin
  std::optional<Mat4> vertexTransform{};  // goes into the vertices: of a node whose matrix has no inverse
};

/// Reads all uses in parallel, in order. scene.materials must be complete (one default at the end if any primitive
/// has none). Appends the meshes to scene.meshes, one per use, and counts and warnings to scene.report.
Expected<void> loadMeshes(const GltfDocument& document, const std::vector<MeshUse>& uses, Scene& scene);

}  // namespace lumel
