// The options of a subcommand as one table: the command line (command_line.cpp) and the config file (config_file.cpp)
// both read it, so that a name, a check, a default and a help text exist once.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// One option. Values arrive as text, whether from the command line or from a config file.
struct Option {
  std::string name{};         // "samples": --samples on the command line, samples = ... in a config file
  std::string group{};        // heading in --help
  std::string placeholder{};  // "N", "R G B"; empty for a flag
  std::string help{};
  int values = 1;  // how many texts `set` takes; 0: a flag (set takes "true" or "false")
  bool positional = false;
  bool required = false;
  bool isPath = false;        // relative paths in a config file are relative to that file
  bool isGiven = false;       // set by the command line or the config
  std::string shortName{};    // "o" for -o; may be empty
  std::string defaultText{};  // shown in --help; empty: nothing to show

  /// Stores the value; returns what is wrong with it ("0 is out of range: at least 1"), or nothing.
  std::function<std::optional<std::string>(std::span<const std::string>)> set{};
  /// The value now, for the resolved settings.
  std::function<nlohmann::ordered_json()> value{};
};

template <class T>
struct Range {
  T least = std::numeric_limits<T>::lowest();
  T most = std::numeric_limits<T>::max();
};

/// Options are stored in the order of declaration; the targets must outlive the table.
class OptionTable {
 public:
  /// Options declared from here on are listed under this heading.
  void group(std::string heading) { group_ = std::move(heading); }

  Option& flag(const std::string& name, bool& target, const std::string& help);
  Option& integer(const std::string& name, int& target, Range<int> range, const std::string& help);
  Option& integer(const std::string& name, std::uint64_t& target, const std::string& help);
  /// A number in the range, or a word that stands for `wordValue`, which lies outside of it.
  Option& integerOrWord(const std::string& name, int& target, Range<int> range, const std::string& word, int wordValue,
                        const std::string& help);
  Option& number(const std::string& name, float& target, Range<float> range, const std::string& help);
  /// A number that may also be given as percent: 1% is 0.01.
  Option& share(const std::string& name, float& target, Range<float> range, const std::string& help);
  /// Empty unless given.
  Option& optionalNumber(const std::string& name, std::optional<float>& target, Range<float> range,
                         const std::string& help);
  Option& color(const std::string& name, Vec3& target, Range<float> range, const std::string& help);
  Option& vector(const std::string& name, std::optional<Vec3>& target, const std::string& help);
  /// Two corners of a box; empty unless given.
  Option& box(const std::string& name, std::optional<std::array<Vec3, 2>>& target, const std::string& help);
  Option& text(const std::string& name, std::string& target, const std::string& help);
  Option& path(const std::string& name, std::filesystem::path& target, const std::string& help);
  Option& positionalPath(const std::string& name, std::filesystem::path& target, const std::string& help);

  /// One of a list of words; `target` becomes the index of the chosen one, cast to the enum.
  template <class E>
  Option& choice(const std::string& name, E& target, std::vector<std::string> words, const std::string& help) {
    return choiceByIndex(
        name, std::move(words), [&target](int i) { target = static_cast<E>(i); },
        [&target] { return static_cast<int>(target); }, help);
  }

  Option* find(const std::string& name);
  /// Tells whether a declared option was given.
  bool isGiven(const std::string& name) const { return const_cast<OptionTable*>(this)->find(name)->isGiven; }
  std::deque<Option>& all() { return options_; }
  const std::deque<Option>& all() const { return options_; }

  /// Every option with its present value; the resolved settings.
  nlohmann::ordered_json resolved() const;

  /// The declared name nearest to a mistyped one, if it is near enough to suggest.
  std::optional<std::string> nearest(const std::string& mistyped) const;

 private:
  Option& add(Option option);
  Option& choiceByIndex(const std::string& name, std::vector<std::string> words, std::function<void(int)> store,
                        std::function<int()> load, const std::string& help);

  std::string group_ = "Options";
  std::deque<Option> options_;  // a deque: references handed out stay valid
};

}  // namespace lumel
