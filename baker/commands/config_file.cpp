#include "baker/commands/config_file.h"

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

#include <charconv>

#include "scene/files/file_access.h"

namespace lumel {
namespace {

/// A TOML scalar as the text that the same option takes on the command line.
std::optional<std::string> scalarText(const toml::node& node) {
  if (const auto v = node.value_exact<std::string>()) return *v;
  if (const auto v = node.value_exact<bool>()) return *v ? "true" : "false";
  if (const auto v = node.value_exact<std::int64_t>()) return std::to_string(*v);
  if (const auto v = node.value_exact<double>()) {
    char buffer[64];
    const auto result = std::to_chars(buffer, buffer + sizeof buffer, *v);
    return std::string(buffer, result.ptr);
  }
  return std::nullopt;
}

std::optional<std::vector<std::string>> texts(const toml::node& node) {
  std::vector<std::string> values;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) {
      const auto text = scalarText(element);
      if (!text) return std::nullopt;
      values.push_back(*text);
    }
    return values;
  }
  const auto text = scalarText(node);
  if (!text) return std::nullopt;
  values.push_back(*text);
  return values;
}

class ConfigReader {
 public:
  ConfigReader(const std::filesystem::path& file, const std::string& command, const std::set<std::string>& allCommands,
               OptionTable& options)
      : file_(file), command_(command), allCommands_(allCommands), options_(options) {}

  Expected<void> read(const toml::table& root) {
    for (const auto& [key, node] : root) {
      const std::string name(key.str());
      if (node.is_table() && allCommands_.count(name)) continue;
      if (auto done = apply(name, node, key.source().begin.line); !done) return done;
    }
    const toml::table* own = root[command_].as_table();
    if (!own) return {};
    for (const auto& [key, node] : *own)
      if (auto done = apply(std::string(key.str()), node, key.source().begin.line); !done) return done;
    return {};
  }

 private:
  Error at(std::uint32_t line, const std::string& message) const {
    return usageError(file_.string() + ":" + std::to_string(line) + ": " + message);
  }

  Expected<void> apply(const std::string& name, const toml::node& node, std::uint32_t line) {
    Option* option = options_.find(name);
    if (!option) {
      std::string message = "unknown key '" + name + "'";
      if (const auto near = options_.nearest(name)) message += "; did you mean '" + *near + "'?";
      return at(line, message + " (keys are the options of 'lumel " + command_ +
                          " --help' but for --quiet, --config and --help)");
    }
    auto values = texts(node);
    if (!values) return at(line, name + ": a table or a date cannot be a value here");
    const std::size_t wanted = option->values == 0 ? 1 : static_cast<std::size_t>(option->values);
    if (values->size() != wanted)
      return at(line, name + " takes " + std::to_string(wanted) + (wanted == 1 ? " value" : " values") + ", here are " +
                          std::to_string(values->size()));
    if (option->isPath && !values->front().empty()) {
      const std::filesystem::path path(values->front());
      if (path.is_relative()) values->front() = (file_.parent_path() / path).string();
    }
    if (const auto problem = option->set(*values)) return at(line, name + ": " + *problem);
    option->isGiven = true;
    return {};
  }

  const std::filesystem::path& file_;
  const std::string& command_;
  const std::set<std::string>& allCommands_;
  OptionTable& options_;
};

}  // namespace

Expected<void> applyConfig(const std::filesystem::path& file, const std::string& command,
                           const std::set<std::string>& allCommands, OptionTable& options) {
  const auto bytes = readFile(file);
  if (!bytes) return usageError(bytes.error().message + "; give a TOML file to --config");
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const toml::parse_result parsed = toml::parse(text, file.string());
  if (!parsed)
    return usageError(file.string() + ":" + std::to_string(parsed.error().source().begin.line) + ": " +
                      std::string(parsed.error().description()));
  return ConfigReader(file, command, allCommands, options).read(parsed.table());
}

}  // namespace lumel
