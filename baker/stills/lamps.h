// Lights of a picture that are not in the bake: what moves in a game, shown over the baked light.
#pragma once

#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// Lamps from text, separated by semicolons: "point:X,Y,Z:CANDELA", "spot:X,Y,Z:DX,DY,DZ:CANDELA:DEGREES" (half the
/// opening of its cone, whose rim is soft), "spot:camera:CANDELA:DEGREES", "point:camera:CANDELA", "sun:DX,DY,DZ:LUX"
/// (where its light goes); each may end in ":R,G,B", a linear colour. Those at the camera hang 20 cm to the right of
/// and below its eye, as a lamp in a hand. Errors: Usage, naming the part.
Expected<std::vector<Light>> parseLamps(const std::string& text, const Camera& camera);

/// What a lamp brings to a surface at `point` that faces it and sees it (lux).
Vec3 lampIrradiance(const Light& lamp, const Vec3& point);

}  // namespace lumel
