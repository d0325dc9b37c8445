#include "baker/commands/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "scene/base/check.h"

namespace lumel {
namespace {

using Texts = std::span<const std::string>;
using Problem = std::optional<std::string>;

/// The shortest text that reads back as the same number.
template <class T>
std::string shortText(T v) {
  char buffer[64];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr};
}

/// A float as the double of the same digits, so that 0.4 stays 0.4 in JSON.
double shortDouble(float v) {
  const std::string text = shortText(v);
  double d = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), d);
  return d;
}

template <class T>
Problem parse(const std::string& text, T& out) {
  T value{};
  const char* first = text.data();
  const char* last = first + text.size();
  if (first != last && *first == '+') ++first;
  const auto [end, error] = std::from_chars(first, last, value);
  const std::string kind = std::is_integral_v<T> ? "a whole number" : "a number";
  if (error == std::errc::result_out_of_range) return text + " is too large";
  if (error != std::errc() || end != last) return "'" + text + "' is not " + kind;
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(value)) return "'" + text + "' is not a finite number";
  out = value;
  return {};
}

template <class T>
Problem parseIn(const std::string& text, Range<T> range, T& out) {
  T value{};
  if (auto problem = parse(text, value)) return problem;
  const bool bounded = range.most != std::numeric_limits<T>::max();
  if (value < range.least || value > range.most) {
    const std::string least = shortText(static_cast<double>(range.least));
    return text + " is out of range: " +
           (bounded ? "use " + least + " to " + shortText(static_cast<double>(range.most))
                    : "use " + least + " or more");
  }
  out = value;
  return {};
}

Problem parseColor(Texts texts, Range<float> range, Vec3& out) {
  Vec3 value(0.0f);
  for (int i = 0; i < 3; ++i) {
    float channel = 0.0f;
    if (auto problem = parseIn(texts[static_cast<std::size_t>(i)], range, channel)) return problem;
    value[i] = channel;
  }
  out = value;
  return {};
}

nlohmann::ordered_json toJson(const Vec3& v) {
  return nlohmann::ordered_json::array({shortDouble(v.x), shortDouble(v.y), shortDouble(v.z)});
}

std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

Option& OptionTable::add(Option option) {
  LUMEL_CHECK(find(option.name) == nullptr);
  if (option.group.empty()) option.group = group_;
  return options_.emplace_back(std::move(option));
}

Option& OptionTable::flag(const std::string& name, bool& target, const std::string& help) {
  Option o{.name = name, .help = help, .values = 0};
  o.set = [&target](Texts texts) -> Problem {
    if (texts[0] != "true" && texts[0] != "false") return "'" + texts[0] + "' is neither true nor false";
    target = texts[0] == "true";
    return {};
  };
  o.value = [&target] { return nlohmann::ordered_json(target); };
  return add(std::move(o));
}

Option& OptionTable::integer(const std::string& name, int& target, Range<int> range, const std::string& help) {
  Option o{.name = name, .placeholder = "N", .help = help, .defaultText = std::to_string(target)};
  o.set = [&target, range](Texts texts) { return parseIn(texts[0], range, target); };
  o.value = [&target] { return nlohmann::ordered_json(target); };
  return add(std::move(o));
}

Option& OptionTable::integer(const std::string& name, std::uint64_t& target, const std::string& help) {
  Option o{.name = name, .placeholder = "N", .help = help, .defaultText = std::to_string(target)};
  o.set = [&target](Texts texts) { return parse(texts[0], target); };
  o.value = [&target] { return nlohmann::ordered_json(target); };
  return add(std::move(o));
}

Option& OptionTable::integerOrWord(const std::string& name, int& target, Range<int> range, const std::string& word,
                                   int wordValue, const std::string& help) {
  Option o{.name = name, .placeholder = "N|" + word, .help = help};
  o.set = [&target, range, word, wordValue](Texts texts) -> Problem {
    if (texts[0] == word) {
      target = wordValue;
      return {};
    }
    auto problem = parseIn(texts[0], range, target);
    if (problem) *problem += ", or '" + word + "'";
    return problem;
  };
  o.value = [&target, word, wordValue] {
    return target == wordValue ? nlohmann::ordered_json(word) : nlohmann::ordered_json(target);
  };
  o.defaultText = target == wordValue ? word : std::to_string(target);
  return add(std::move(o));
}

Option& OptionTable::number(const std::string& name, float& target, Range<float> range, const std::string& help) {
  Option o{.name = name, .placeholder = "X", .help = help, .defaultText = shortText(target)};
  o.set = [&target, range](Texts texts) { return parseIn(texts[0], range, target); };
  o.value = [&target] { return nlohmann::ordered_json(shortDouble(target)); };
  return add(std::move(o));
}

Option& OptionTable::share(const std::string& name, float& target, Range<float> range, const std::string& help) {
  Option& o = number(name, target, range, help);
  o.set = [&target, range](Texts texts) -> Problem {
    const std::string& text = texts[0];
    const bool percent = text.ends_with('%');
    float value = 0.0f;
    if (auto problem = parse(percent ? text.substr(0, text.size() - 1) : text, value)) return problem;
    if (percent) value /= 100.0f;
    if (value < range.least || value > range.most)
      return text + " is out of range: use " + shortText(100.0f * range.least) + "% to " +
             shortText(100.0f * range.most) + "%, or " + shortText(range.least) + " to " + shortText(range.most);
    target = value;
    return {};
  };
  return o;
}

Option& OptionTable::optionalNumber(const std::string& name, std::optional<float>& target, Range<float> range,
                                    const std::string& help) {
  Option o{.name = name, .placeholder = "X", .help = help};
  o.set = [&target, range](Texts texts) -> Problem {
    float value = 0.0f;
    if (auto problem = parseIn(texts[0], range, value)) return problem;
    target = value;
    return {};
  };
  o.value = [&target] { return target ? nlohmann::ordered_json(shortDouble(*target)) : nlohmann::ordered_json(); };
  return add(std::move(o));
}

Option& OptionTable::color(const std::string& name, Vec3& target, Range<float> range, const std::string& help) {
  Option o{.name = name, .placeholder = "R G B", .help = help, .values = 3};
  o.set = [&target, range](Texts texts) { return parseColor(texts, range, target); };
  o.value = [&target] { return toJson(target); };
  return add(std::move(o));
}

Option& OptionTable::vector(const std::string& name, std::optional<Vec3>& target, const std::string& help) {
  Option o{.name = name, .placeholder = "X Y Z", .help = help, .values = 3};
  o.set = [&target](Texts texts) -> Problem {
    Vec3 value(0.0f);
    if (auto problem = parseColor(texts, {}, value)) return problem;
    target = value;
    return {};
  };
  o.value = [&target] { return target ? toJson(*target) : nlohmann::ordered_json(); };
  return add(std::move(o));
}

Option& OptionTable::box(const std::string& name, std::optional<std::array<Vec3, 2>>& target, const std::string& help) {
  Option o{.name = name, .placeholder = "X0 Y0 Z0 X1 Y1 Z1", .help = help, .values = 6};
  o.set = [&target](Texts texts) -> Problem {
    std::array<Vec3, 2> corners{};
    for (std::size_t i = 0; i < 2; ++i)
      if (auto problem = parseColor(texts.subspan(3 * i, 3), {}, corners[i])) return problem;
    target = corners;
    return {};
  };
  o.value = [&target] {
    return target ? nlohmann::ordered_json{toJson((*target)[0]), toJson((*target)[1])} : nlohmann::ordered_json();
  };
  return add(std::move(o));
}

Option& OptionTable::text(const std::string& name, std::string& target, const std::string& help) {
  Option o{.name = name, .placeholder = "TEXT", .help = help, .defaultText = target};
  o.set = [&target](Texts texts) -> Problem {
    target = texts[0];
    return {};
  };
  o.value = [&target] { return nlohmann::ordered_json(target); };
  return add(std::move(o));
}

Option& OptionTable::path(const std::string& name, std::filesystem::path& target, const std::string& help) {
  Option o{.name = name, .placeholder = "FILE", .help = help, .isPath = true, .defaultText = target.string()};
  o.set = [&target](Texts texts) -> Problem {
    if (texts[0].empty()) return "the path is empty";
    target = texts[0];
    return {};
  };
  o.value = [&target] { return target.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(target.string()); };
  return add(std::move(o));
}

Option& OptionTable::positionalPath(const std::string& name, std::filesystem::path& target, const std::string& help) {
  Option& o = path(name, target, help);
  o.positional = true;
  o.required = true;
  return o;
}

Option& OptionTable::choiceByIndex(const std::string& name, std::vector<std::string> words,
                                   std::function<void(int)> store, std::function<int()> load, const std::string& help) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : "|") + word;
  Option o{.name = name, .placeholder = list, .help = help, .defaultText = words[static_cast<std::size_t>(load())]};
  o.set = [words, list, store](Texts texts) -> Problem {
    const auto found = std::find(words.begin(), words.end(), texts[0]);
    if (found == words.end()) return "'" + texts[0] + "' is not one of " + list;
    store(static_cast<int>(found - words.begin()));
    return {};
  };
  o.value = [words, load] { return nlohmann::ordered_json(words[static_cast<std::size_t>(load())]); };
  return add(std::move(o));
}

Option* OptionTable::find(const std::string& name) {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

nlohmann::ordered_json OptionTable::resolved() const {
  nlohmann::ordered_json settings;
  for (const Option& o : options_) settings[o.name] = o.value();
  return settings;
}

std::optional<std::string> OptionTable::nearest(const std::string& mistyped) const {
  std::optional<std::string> best;
  std::size_t bestDistance = std::max<std::size_t>(2, mistyped.size() / 3) + 1;
  for (const Option& o : options_) {
    const std::size_t distance = editDistance(mistyped, o.name);
    if (distance >= bestDistance) continue;
    bestDistance = distance;
    best = o.name;
  }
  return best;
}

}  // namespace lumel
