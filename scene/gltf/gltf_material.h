// glTF materials, textures and images to plain data. Private to scene/gltf_*.cpp.
#pragma once

#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// Fills scene.materials (in file order, then a default one if a primitive has none, or if there are none) and
/// scene.images (those that a material reads). A missing image is a warning; a path outside the folder an error.
Expected<void> loadMaterials(const GltfDocument& document, Scene& scene);

}  // namespace lumel
