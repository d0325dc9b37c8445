// Mip chains of maps whose channels are positive weights: they may be averaged as they are.
#pragma once

#include <vector>

#include "scene/base/progress.h"
#include "scene/image.h"

namespace lumel::ssbump {

enum class MipFilter {
  Box,     // exact mean over the texels covered, also for odd sizes: the map's mean is kept
  Kaiser,  // windowed sinc of three lobes: sharper; results are held to the range 0..1 of the weights
};

/// The next smaller level, max(1, floor(side / 2)) on each side. Kaiser wraps or clamps at the edges.
/// Once `progress` is cancelled the rest is left out: ask it.
Image halve(const Image& image, MipFilter filter, bool wrap, const Progress& progress = noProgress());

/// All levels below `image` down to 1x1, largest first; fewer once `progress` is cancelled.
std::vector<Image> mipLevels(const Image& image, MipFilter filter, bool wrap, const Progress& progress = noProgress());

}  // namespace lumel::ssbump
