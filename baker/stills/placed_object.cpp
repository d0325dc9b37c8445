#include "baker/stills/placed_object.h"

namespace lumel {

void placeObject(Scene& scene, const Scene& object, const Vec3& at) {
  const int firstImage = static_cast<int>(scene.images.size());
  const int firstMaterial = static_cast<int>(scene.materials.size());
  const int firstMesh = static_cast<int>(scene.meshes.size());
  scene.images.insert(scene.images.end(), object.images.begin(), object.images.end());
  for (Material material : object.materials) {
    for (TextureRef* map : {&material.baseColorMap, &material.metallicRoughnessMap, &material.normalMap,
                            &material.occlusionMap, &material.ssbumpMap, &material.emissionMap})
      if (*map) map->image += firstImage;
    scene.materials.push_back(std::move(material));
  }
  for (Mesh mesh : object.meshes) {
    for (Primitive& primitive : mesh.primitives) {
      primitive.material += firstMaterial;
      primitive.lightmapPage = -1;
    }
    scene.meshes.push_back(std::move(mesh));
  }
  for (Instance instance : object.instances) {
    instance.mesh += firstMesh;
    instance.lightmap = {};
    instance.worldFromObject[3] += Vec4(at, 0.0f);
    scene.instances.push_back(std::move(instance));
  }
}

}  // namespace lumel
