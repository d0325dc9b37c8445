// The layout of an earlier bake, from its bake.json, for a bake that moves as little as it can.
#pragma once

#include <filesystem>
#include <memory>

#include "lightmap/atlas/layout_memory.h"
#include "scene/base/expected.h"

namespace lumel {

/// Nothing where the folder holds no bake, or one without generated charts: the first bake of a level has none.
/// Errors: Input, naming the file: bake.json is damaged or of another format.
Expected<std::shared_ptr<const RememberedLayout>> readEarlierLayout(const std::filesystem::path& dir);

}  // namespace lumel
