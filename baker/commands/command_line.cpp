// The one door to CLI11.
#include "baker/commands/command_line.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <ostream>
#include <set>
#include <span>

#include "baker/commands/config_file.h"
#include "baker/commands/help.h"
#include "baker/commands/manual.h"
#include "baker/commands/terminal_progress.h"
#include "baker/files/names/version.h"

namespace lumel {
namespace {

/// A subcommand with what its arguments were parsed into.
struct Parsed {
  Command command;
  CLI::App* app = nullptr;
  std::map<std::string, std::vector<std::string>> texts;  // by option name; filled by CLI11
  std::map<std::string, CLI::Option*> given;
  std::string config;
  bool quiet = false;
};

void declare(Parsed& parsed, CLI::App& root) {
  CLI::App* app = root.add_subcommand(parsed.command.name, parsed.command.summary);
  parsed.app = app;
  for (Option& option : parsed.command.options.all()) {
    std::vector<std::string>& texts = parsed.texts[option.name];
    std::string names = option.positional ? option.name : "--" + option.name;
    if (!option.shortName.empty()) names = "-" + option.shortName + "," + names;
    // "--no-NAME" turns off what a config file turned on.
    CLI::Option* declared = option.values == 0 ? app->add_flag(names + ",!--no-" + option.name, texts)
                                               : app->add_option(names, texts)->expected(option.values)->type_size(1);
    // The last of a repeated option counts; one positional must not take the next one's text.
    declared->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    parsed.given[option.name] = declared;
  }
  if (parsed.command.takesConfig) app->add_option("--config", parsed.config);
  app->add_flag("--quiet,-q", parsed.quiet);
}

/// Adds the nearest option name to CLI11's complaint about an unknown one.
std::string explain(const CLI::ParseError& error, const std::vector<std::string>& arguments, const Parsed* parsed) {
  std::string message = error.what();
  while (!message.empty() && (message.back() == '\n' || message.back() == '.')) message.pop_back();
  for (char& c : message)
    if (c == '\n') c = ' ';
  if (!parsed) return message + "; see lumel --help";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error))
    for (const Option& option : parsed->command.options.all())
      if (message.starts_with("--" + option.name + ":"))
        message = "--" + option.name + ": the value is missing: " + option.placeholder;
  if (dynamic_cast<const CLI::ExtrasError*>(&error))
    for (const std::string& argument : arguments) {
      if (argument.rfind("--", 0) != 0) continue;
      const std::string name =
          argument.substr(2, argument.find('=') == std::string::npos ? std::string::npos : argument.find('=') - 2);
      if (parsed->given.count(name) || name == "quiet" || name == "config" || name == "help") continue;
      message = "unknown option --" + name;
      if (const auto near = parsed->command.options.nearest(name)) message += "; did you mean --" + *near + "?";
      break;
    }
  return message + "; see lumel " + parsed->command.name + " --help";
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

Expected<void> fillOptions(Parsed& parsed, const std::set<std::string>& allCommands) {
  if (!parsed.config.empty())
    if (auto done = applyConfig(parsed.config, parsed.command.name, allCommands, parsed.command.options); !done)
      return done;
  for (Option& option : parsed.command.options.all()) {
    const std::string shown = option.positional ? option.name : "--" + option.name;
    if (parsed.given[option.name]->count() > 0) {
      const std::size_t wanted = option.values == 0 ? 1 : static_cast<std::size_t>(option.values);
      if (parsed.texts[option.name].size() != wanted)
        return usageError(shown + ": takes " + std::to_string(wanted) + " values: " + option.placeholder);
      if (const auto problem = option.set(parsed.texts[option.name])) return usageError(shown + ": " + *problem);
      option.isGiven = true;
    }
    if (option.required && !option.isGiven)
      return usageError((option.positional ? option.placeholder : shown + " " + option.placeholder) +
                        " is missing; see lumel " + parsed.command.name + " --help");
  }
  return {};
}

/// `lumel help`: nothing, a command, or for the build --man [COMMAND] or --completion. `text` is that of lumel itself.
Expected<void> runHelp(const std::vector<std::string>& arguments, std::span<const Command* const> commands,
                       const std::string& text, std::ostream& out) {
  const bool isManual = arguments.size() > 1 && arguments[1] == "--man";
  const std::size_t at = isManual ? 2 : 1;
  if (arguments.size() > at + 1) return usageError("help takes one command; see lumel --help");
  if (arguments.size() == at) {
    out << (isManual ? manPageOfAll(commands) : text);
    return {};
  }
  if (arguments[at] == "--completion") {
    out << bashCompletion(commands);
    return {};
  }
  std::set<std::string> names;
  for (const Command* command : commands) {
    names.insert(command->name);
    if (command->name != arguments[at]) continue;
    out << (isManual ? manPage(*command) : helpText(*command));
    return {};
  }
  return usageError("unknown command '" + arguments[at] + "'; use one of " + joined(names) + "; see lumel --help");
}

}  // namespace

Expected<void> runCommandLine(const std::vector<std::string>& arguments, std::ostream& out) {
  CLI::App root(
      "Lumel bakes lightmaps for game levels: path-traced light into three maps per page (radiosity normal mapping).",
      "lumel");
  root.require_subcommand(1);
  root.set_version_flag("--version", std::string("lumel ") + kVersion, "Print the version and stop");
  root.footer(
      "A level from start to picture:\n"
      "  lumel bake level.gltf -o out/level --sky-color 0.4 0.6 1\n"
      "  lumel render out/level -o out/level.png\n"
      "\n"
      "lumel help COMMAND explains a command. Exit codes:\n" +
      std::string(kExitCodes) + ".");

  std::vector<std::unique_ptr<Parsed>> commands;
  std::set<std::string> names;
  for (auto make : {bakeCommand, ssbumpCommand, renderCommand, infoCommand, diffCommand, convertCommand, exportCommand,
                    studyCommand}) {
    commands.push_back(std::make_unique<Parsed>());
    commands.back()->command = make();
    names.insert(commands.back()->command.name);
    declare(*commands.back(), root);
  }

  const auto chosen = [&]() -> Parsed* {
    for (const auto& parsed : commands)
      if (parsed->app->parsed()) return parsed.get();
    return nullptr;
  };
  if (arguments.empty() || arguments[0] == "help") {
    std::vector<const Command*> all;
    for (const auto& parsed : commands) all.push_back(&parsed->command);
    return runHelp(arguments.empty() ? std::vector<std::string>{"help"} : arguments, all, root.help(), out);
  }
  if (!arguments[0].starts_with('-') && !names.count(arguments[0]))
    return usageError("unknown command '" + arguments[0] + "'; use one of " + joined(names) + "; see lumel --help");
  try {
    root.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    const Parsed* parsed = chosen();
    out << (parsed ? helpText(parsed->command) : root.help());
    return {};
  } catch (const CLI::CallForVersion& version) {
    out << version.what() << '\n';
    return {};
  } catch (const CLI::ParseError& error) {
    return usageError(explain(error, arguments, chosen()));
  }

  Parsed& parsed = *chosen();
  if (auto filled = fillOptions(parsed, names); !filled) return filled;
  TerminalProgress progress(parsed.quiet);
  CommandContext context{progress, out, parsed.quiet, parsed.command.options.resolved(), parsed.command.options};
  return parsed.command.run(context);
}

}  // namespace lumel
