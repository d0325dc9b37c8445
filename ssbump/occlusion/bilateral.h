// Edge-preserving smoothing of heights, against the stair-steps of 8-bit maps (Tomasi and Manduchi 1998).
#pragma once

#include "scene/base/progress.h"
#include "ssbump/occlusion/height_field.h"

namespace lumel::ssbump {

/// Replaces each height by a weighted mean of those within `radius` texels (Gaussian, sigma = radius / 2) whose height
/// differs by less than `thresholdTexels` (Tukey's biweight, 0 at the threshold): larger steps stay as they are.
/// Wraps with the field; without wrap texels outside do not count. radius 0 or a threshold of 0: unchanged.
/// `progress` advances by rows; once it is cancelled the field stays as it was.
void bilateralFilter(HeightField& field, int radius, float thresholdTexels, Progress& progress = noProgress());

}  // namespace lumel::ssbump
