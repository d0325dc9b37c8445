// The last step before a bake is written: texels beside the charts get values, so that bilinear lookup at a chart's
// border does not mix in black.
#pragma once

#include <vector>

#include "baker/bake.h"

namespace lumel {

/// Grows every map of every page by `rings` texels beyond what aux says is covered. The aux image is left as it is, so
/// it still tells own values from grown ones.
void dilatePages(std::vector<BakedPage>& pages, int rings);

}  // namespace lumel
