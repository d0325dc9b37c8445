// Checks a glTF 2.0 JSON document before anything relies on it: types, required members, lengths, and that every
// index points into its array. What passes can be read without further checks of the JSON; what the numbers refer
// to (byte ranges, vertex indices) is checked where the bytes are read.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace lumel {

/// The first thing wrong, as "accessors/3/bufferView: is 12, but there are 4 bufferViews"; nothing if all is well.
/// Members of extensions that the loader reads are checked too; unknown members are ignored.
std::optional<std::string> checkGltfSchema(const nlohmann::json& root);

}  // namespace lumel
