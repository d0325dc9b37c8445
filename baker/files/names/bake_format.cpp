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

}  // namespace lumel
