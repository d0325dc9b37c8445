// The one door to meshoptimizer: EXT_meshopt_compression and KHR_meshopt_compression.
#pragma once

#include "scene/base/expected.h"

namespace lumel {

struct GltfDocument;

/// Decompresses every compressed buffer view into document.decodedViews. Errors: Input, naming the buffer view.
Expected<void> decodeMeshoptViews(GltfDocument& document);

}  // namespace lumel
