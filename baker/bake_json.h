// The text of bake.json.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "baker/bake_files.h"

namespace lumel {

/// What a row of "charts" holds: page, object, density, number of triangles; then, for --layout-from, a key that stands
/// for the object's name and the chart's triangles (null with the scene's own UVs), and where the chart's box lies.
const std::vector<std::string>& chartColumns();

/// The value of one of these columns in a row that has them all.
const nlohmann::ordered_json& chartColumn(const nlohmann::ordered_json& row, std::string_view name);

/// Settings as resolved, conventions, pages, charts, what the scene's own UVs were found to be, error figures and,
/// under "run", what differs from run to run: times, threads, memory.
std::string describeBake(const Scene& scene, const AtlasResult& atlas, const BakeResult& result,
                         const BakeRecord& record);

}  // namespace lumel
