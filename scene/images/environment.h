// Light from infinity: the image of a sky, and its radiance in a direction (conventions: Environment in scene.h).
#pragma once

#include <filesystem>

#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// An equirectangular .hdr or .exr (any float image), linear; grey is spread to RGB, further channels are left out.
/// Errors: Input: not a float image, or a pixel that is negative, NaN or infinite (a clipped sun has no radiance to
/// importance-sample; it needs a finite one), named by its place.
Expected<Environment> loadEnvironment(const std::filesystem::path& file);

/// Radiance from direction dirWorld (unit) towards the scene, times strength: bilinear, wrapping around the horizon,
/// clamped at the poles.
Vec3 environmentRadiance(const Environment& environment, const Vec3& dirWorld);

}  // namespace lumel
