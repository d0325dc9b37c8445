// Sky domes: meshes around a level that only paint its sky, and keep sun and sky out of a bake.
#pragma once

#include <vector>

#include "scene/scene.h"

namespace lumel {

/// Returns the instances that look like sky domes, as indices into Scene::instances: they cast, do not shine, and
/// enclose everything else from the sides and above; and either all of their materials are unlit, or all of their
/// vertices lie at the same distance from one point (within a tenth), or their name holds "sky". Empty where there is
/// nothing else.
std::vector<int> findSkyDomes(const Scene& scene);

}  // namespace lumel
