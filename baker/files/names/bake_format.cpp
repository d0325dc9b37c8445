#include "baker/files/names/bake_format.h"

namespace lumel {

using Json = nlohmann::ordered_json;

const std::vector<std::string>& chartColumns() {
  static const std::vector<std::string> columns = {
      "page", "instance", "primitive", "texelsPerMeter", "triangles", "key", "quarterTurns", "x", "y"};
  return columns;
}

const Json& chartColumn(const Json& row, std::string_view name) {
  std::size_t i = 0;
  while (chartColumns()[i] != name) ++i;
  return row[i];
}

Json describeEncoding(const Encoding& encoding) {
  return {{"name", encoding.name()},
          {"maps", encoding.mapNames()},
          {"domain", nameOf(encoding.domain())},
          {"signed", encoding.isSigned()}};
}

std::string bakeJsonText(const Json& bake) {
  // Names come from files and need not be valid UTF-8.
  const auto dump = [](const Json& value, int indent) {
    return value.dump(indent, ' ', false, Json::error_handler_t::replace);
  };
  // One line per entry of the first level down keeps long lists readable and small.
  std::string text = "{";
  const char* separator = "\n";
  for (const auto& [key, value] : bake.items()) {
    const bool compact = key == "charts";
    text += separator + dump(Json(key), -1) + ": " + dump(value, compact ? -1 : 2);
    separator = ",\n";
  }
  return text + "\n}\n";
}

}  // namespace lumel
