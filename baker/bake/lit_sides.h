// A lightmap has one texel for both sides of a double-sided surface, so it must hold the light of the side that is
// seen. Modelling tools that draw both sides leave faces wound either way; one wound into a closed solid would be
// black.
#pragma once

#include <cstddef>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/scene.h"

namespace lumel {

/// Turns double-sided surfaces round whose front is in the dark while their back is lit: winding, normals and tangents.
/// They look the same from both sides afterwards, as double-sided surfaces do by the glTF specification.
/// Decided for patches: triangles of a primitive that are joined by edges (vertices at equal places count as one) and
/// wound alike. A patch is turned if its back has a million times its front's light, or twice as much where it is wound
/// against patches that share edges with it and whose fronts have more light together; light is path traced. Where a
/// mesh is placed several times, the light of its first few places counts together. Cut-out and blended
/// surfaces are sheets and no sides of solids: they stay, as unlit ones do. Instances that receive nothing have no say.
/// Returns how many triangles were turned. The result does not depend on the number of threads. Errors: Failed (Embree,
/// memory), Interrupted.
Expected<std::size_t> turnToLight(Scene& scene, const Progress& progress);

}  // namespace lumel
