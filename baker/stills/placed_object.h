// Things in a still that are not part of the bake.
#pragma once

#include "scene/scene.h"

namespace lumel {

/// Adds what `object` holds to `scene`, moved by `at`: meshes, instances, materials and images, without lightmaps,
/// lights, cameras and sky.
void placeObject(Scene& scene, const Scene& object, const Vec3& at);

}  // namespace lumel
