#include "baker/files/read/earlier_layout.h"

#include <charconv>
#include <cmath>

#include "baker/files/names/bake_format.h"
#include "baker/files/read/baked_scene.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A whole number that an int holds; nothing for anything else.
std::optional<int> asInt(const Json& value) {
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  if (!(std::abs(number) <= 1e9) || number != std::floor(number)) return std::nullopt;
  return static_cast<int>(number);
}

std::optional<std::uint64_t> asKey(const Json& value) {
  if (!value.is_string()) return std::nullopt;
  const auto& text = value.get_ref<const std::string&>();
  std::uint64_t key = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), key, 16);
  if (text.empty() || parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return key;
}

const Json& memberOf(const Json& json, const char* key) {
  static const Json kNull;
  if (!json.is_object()) return kNull;
  const auto found = json.find(key);
  return found == json.end() ? kNull : *found;
}

bool readRules(const Json& json, RememberedLayout& layout, int& firstPage) {
  const Json& density = memberOf(json, "chartDensity");
  const Json& scale = memberOf(json, "scale");
  const Json& stretch = memberOf(json, "maxStretch");
  const auto pageSize = asInt(memberOf(json, "pageSize"));
  const auto padding = asInt(memberOf(json, "padding"));
  const auto block = asInt(memberOf(json, "blockAlign"));
  const auto first = asInt(memberOf(json, "firstPage"));
  if (!density.is_number() || !scale.is_number() || !stretch.is_number() || !pageSize || !padding || !block || !first)
    return false;
  layout.chartDensity = density.get<double>();
  layout.scale = scale.get<double>();
  layout.maxStretch = stretch.get<float>();
  layout.pageSize = *pageSize;
  layout.padding = *padding;
  layout.blockAlign = *block;
  firstPage = *first;
  return layout.chartDensity > 0 && layout.scale > 0;
}

/// One row of the list of charts; nothing if it is damaged. Rows without a key came with the scene's UVs.
bool readChart(const Json& row, int firstPage, RememberedLayout& layout) {
  if (!row.is_array() || row.size() != chartColumns().size()) return false;
  const auto column = [&row](const char* name) -> const Json& { return chartColumn(row, name); };
  if (column("key").is_null()) return true;
  const auto key = asKey(column("key"));
  const auto page = asInt(column("page"));
  const auto turns = asInt(column("quarterTurns"));
  const auto x = asInt(column("x"));
  const auto y = asInt(column("y"));
  if (!key || !page || !turns || !x || !y || *page < firstPage) return false;
  layout.charts.push_back({*key, {*page - firstPage, *turns, *x, *y}});
  return true;
}

}  // namespace

Expected<std::shared_ptr<const RememberedLayout>> readEarlierLayout(const fs::path& dir) {
  std::shared_ptr<const RememberedLayout> none;
  std::error_code ec;
  if (!fs::exists(dir / "bake.json", ec)) return none;
  const auto json = readBakeJson(dir);
  if (!json) return json.error();
  const Json& rules = memberOf(memberOf(*json, "atlas"), "layout");
  if (rules.is_null()) return none;
  const auto damaged = [&dir](const char* what) {
    return inputError((dir / "bake.json").string() + ": " + what + "; bake without --layout-from");
  };
  auto layout = std::make_shared<RememberedLayout>();
  int firstPage = 0;
  if (!readRules(rules, *layout, firstPage)) return damaged("/atlas/layout is not what this version writes");
  const Json& charts = memberOf(*json, "charts");
  const Json& columns = memberOf(charts, "columns");
  const Json& rows = memberOf(charts, "rows");
  if (columns != Json(chartColumns()) || !rows.is_array()) return damaged("/charts is not what this version writes");
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!readChart(rows[i], firstPage, *layout))
      return damaged(("/charts/rows/" + std::to_string(i) + " is not a chart").c_str());
  return std::shared_ptr<const RememberedLayout>(std::move(layout));
}

}  // namespace lumel
