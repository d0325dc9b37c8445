#include "baker/commands/help.h"

#include <sstream>
#include <vector>

namespace lumel {
namespace {

constexpr std::size_t kWidth = 100;
constexpr std::size_t kColumn = 30;  // where explanations start

/// One option with its explanation, wrapped into the second column.
std::string entry(const std::string& names, const std::string& explanation) {
  std::string text = "  " + names;
  if (text.size() + 2 > kColumn)
    text += "\n" + std::string(kColumn, ' ');
  else
    text.resize(kColumn, ' ');
  std::istringstream words(explanation);
  std::size_t at = kColumn;
  for (std::string word; words >> word;) {
    if (at > kColumn && at + 1 + word.size() > kWidth) {
      text += "\n" + std::string(kColumn, ' ');
      at = kColumn;
    }
    if (at > kColumn) {
      text += ' ';
      ++at;
    }
    text += word;
    at += word.size();
  }
  return text + "\n";
}

std::string namesOf(const Option& option) {
  if (option.positional) return option.placeholder;
  std::string names = (option.shortName.empty() ? "" : "-" + option.shortName + ", ") + "--" + option.name;
  return option.placeholder.empty() ? names : names + " " + option.placeholder;
}

}  // namespace

std::string explanationOf(const Option& option) {
  if (option.defaultText.empty() || option.values == 0) return option.help;
  return option.help + " [" + option.defaultText + "]";
}

std::vector<std::pair<std::string, std::string>> commonOptions(const Command& command) {
  std::vector<std::pair<std::string, std::string>> options;
  if (command.takesConfig)
    options.emplace_back("--config FILE", "Options from a TOML file; the command line wins over it");
  options.emplace_back("-q, --quiet", "Print nothing but errors");
  options.emplace_back("-h, --help", "Print this text and stop");
  return options;
}

std::string helpText(const Command& command) {
  std::string usage = "Usage: lumel " + command.name;
  std::string arguments;
  std::vector<std::string> groups;
  for (const Option& option : command.options.all()) {
    if (option.required)
      usage += " " + (option.positional || option.shortName.empty() ? "" : "-" + option.shortName + " ") +
               option.placeholder;
    if (option.positional)
      arguments += entry(namesOf(option), explanationOf(option));
    else if (groups.empty() || groups.back() != option.group)
      groups.push_back(option.group);
  }
  std::string text = command.summary + ".\n\n" + usage + " [options]\n\n" + arguments;
  for (const std::string& group : groups) {
    text += "\n" + group + "\n";
    for (const Option& option : command.options.all())
      if (!option.positional && option.group == group) text += entry(namesOf(option), explanationOf(option));
  }
  if (groups.empty() || groups.back() != "General") text += "\nGeneral\n";
  for (const auto& [names, explanation] : commonOptions(command)) text += entry(names, explanation);
  return text + "\n" + command.examples + "\n";
}

}  // namespace lumel
