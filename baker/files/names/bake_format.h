// What bake.json holds, as far as its writer and its readers must agree on it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "lightmap/maps/encoding.h"

namespace lumel {

/// Version of the layout of bake.json; a reader refuses others.
inline constexpr int kBakeFormat = 1;

/// What a row of "charts" holds: page, object, density, number of triangles; then, for --layout-from, a key that stands
/// for the object's name and the chart's triangles (null with the scene's own UVs), and where the chart's box lies.
const std::vector<std::string>& chartColumns();

/// The value of one of these columns in a row that has them all.
const nlohmann::ordered_json& chartColumn(const nlohmann::ordered_json& row, std::string_view name);

/// "encoding" in bake.json: name, maps, domain, signed.
nlohmann::ordered_json describeEncoding(const Encoding& encoding);

/// The text of bake.json: the long list of charts on a line of its own.
std::string bakeJsonText(const nlohmann::ordered_json& bake);

}  // namespace lumel
