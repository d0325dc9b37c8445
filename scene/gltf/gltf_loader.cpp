#include "scene/gltf/gltf_loader.h"

#include <exception>

#include "scene/gltf/gltf_document.h"
#include "scene/gltf/gltf_material.h"
#include "scene/gltf/gltf_mesh.h"
#include "scene/gltf/gltf_nodes.h"
#include "scene/images/ssbump_maps.h"

namespace lumel {
namespace {

/// Instances of meshes without any triangle go, and so do those meshes.
void dropEmptyMeshes(Scene& scene) {
  std::vector<int> renumbered(scene.meshes.size(), -1);
  std::vector<Mesh> kept;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m)
    if (!scene.meshes[m].primitives.empty()) {
      renumbered[m] = static_cast<int>(kept.size());
      kept.push_back(std::move(scene.meshes[m]));
    }
  scene.meshes = std::move(kept);
  std::erase_if(scene.instances, [&](const Instance& i) { return renumbered[static_cast<std::size_t>(i.mesh)] < 0; });
  for (Instance& instance : scene.instances) instance.mesh = renumbered[static_cast<std::size_t>(instance.mesh)];
}

Expected<Scene> load(std::vector<std::uint8_t> bytes, const std::string& name, const std::filesystem::path& folder,
                     const LoadOptions& options) {
  auto document = openGltf(std::move(bytes), name, folder, options);
  if (!document) return document.error();
  Scene scene;
  scene.report.warnings = document->warnings;
  if (auto loaded = loadMaterials(*document, scene); !loaded) return loaded.error();
  if (auto assigned = assignSsbumpMaps(scene, options); !assigned) return assigned.error();
  auto uses = flattenNodes(*document, scene);
  if (!uses) return uses.error();
  if (auto loaded = loadMeshes(*document, *uses, scene); !loaded) return loaded.error();
  dropEmptyMeshes(scene);
  return scene;
}

}  // namespace

Expected<Scene> loadGltf(std::vector<std::uint8_t> bytes, const std::string& name, const std::filesystem::path& folder,
                         const LoadOptions& options) {
  try {
    return load(std::move(bytes), name, folder, options);
  } catch (const std::bad_alloc&) {
    return failure(name + ": not enough memory to load it");
  } catch (const std::exception& e) {
    return inputError(name + ": " + e.what());
  }
}

}  // namespace lumel
