// A camera for scenes that have none.
#pragma once

#include "baker/stills/compositor.h"

namespace lumel {

/// Tries viewpoints inside the scene (at eye height over floors that rays find) and such that show all of it from
/// outside, looks from each with a grid of rays, and takes the one that sees most: lit surfaces of varied brightness
/// and distance, not the backs of walls, not a surface right before the eye, not empty sky. Deterministic.
Camera chooseViewpoint(const Compositor& compositor, float aspect);

/// A camera at `position` that looks at `target`, y up (z up where it looks straight up or down).
Camera cameraLookingAt(const Vec3& position, const Vec3& target, float yFov);

}  // namespace lumel
