// The text of bake.json.
#pragma once

#include <string>

#include "baker/files/write/bake_files.h"

namespace lumel {

/// Settings as resolved, conventions, pages, charts, what the scene's own UVs were found to be, error figures and,
/// under "run", what differs from run to run: times, threads, memory.
std::string describeBake(const Scene& scene, const AtlasResult& atlas, const BakeResult& result,
                         const BakeRecord& record);

}  // namespace lumel
