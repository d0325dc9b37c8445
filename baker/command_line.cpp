// The one door to CLI11.
#include "baker/command_line.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <ostream>
#include <set>

#include "baker/config_file.h"
#include "baker/terminal_progress.h"
#include "baker/version.h"

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

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(34); }
  std::string make_option_opts(const CLI::Option* option) const override {
    return option->get_type_size() == 0 ? "" : " " + option->get_option_text();
  }
};

std::string helpOf(const Option& option) {
  if (option.defaultText.empty() || option.values == 0) return option.help;
  return option.help + " [" + option.defaultText + "]";
}

void declare(Parsed& parsed, CLI::App& root, const std::shared_ptr<HelpFormatter>& formatter) {
  CLI::App* app = root.add_subcommand(parsed.command.name, parsed.command.summary);
  parsed.app = app;
  app->formatter(formatter);
  app->footer(parsed.command.examples);
  app->get_help_ptr()->group("General")->description("Print this text and stop");
  for (Option& option : parsed.command.options.all()) {
    std::vector<std::string>& texts = parsed.texts[option.name];
    std::string names = option.positional ? option.name : "--" + option.name;
    if (!option.shortName.empty()) names = "-" + option.shortName + "," + names;
    CLI::Option* declared = nullptr;
    if (option.values == 0) {
      // "--no-NAME" turns off what a config file turned on.
      declared = app->add_flag(names + ",!--no-" + option.name, texts, option.help)
                     ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    } else {
      declared = app->add_option(names, texts, helpOf(option))
                     ->expected(option.values)
                     ->type_size(1)
                     ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
                     ->option_text(option.positional ? "" : option.placeholder);
    }
    declared->group(option.positional ? "Arguments" : option.group);
    parsed.given[option.name] = declared;
  }
  if (parsed.command.takesConfig)
    app->add_option("--config", parsed.config, "Options from a TOML file; the command line wins over it")
        ->option_text("FILE")
        ->group("General");
  app->add_flag("--quiet,-q", parsed.quiet, "Print nothing but errors")->group("General");
}

/// Adds the nearest option name to CLI11's complaint about an unknown one.
std::string explain(const CLI::ParseError& error, const std::vector<std::string>& arguments, const Parsed* parsed) {
  std::string message = error.what();
  while (!message.empty() && (message.back() == '\n' || message.back() == '.')) message.pop_back();
  for (char& c : message)
    if (c == '\n') c = ' ';
  if (!parsed) return message + "; see lumel --help";
  if (error.get_name() == "ExtrasError")
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

Expected<void> fillOptions(Parsed& parsed, const std::set<std::string>& allCommands) {
  const std::string prefix = "lumel " + parsed.command.name + ": ";
  if (!parsed.config.empty())
    if (auto done = applyConfig(parsed.config, parsed.command.name, allCommands, parsed.command.options); !done)
      return done;
  for (Option& option : parsed.command.options.all()) {
    const std::string shown = option.positional ? option.name : "--" + option.name;
    if (parsed.given[option.name]->count() > 0) {
      if (const auto problem = option.set(parsed.texts[option.name])) return usageError(shown + ": " + *problem);
      option.isGiven = true;
    }
    if (option.required && !option.isGiven)
      return usageError((option.positional ? option.name : shown + " " + option.placeholder) +
                        " is missing; see lumel " + parsed.command.name + " --help");
  }
  return {};
}

}  // namespace

Expected<void> runCommandLine(const std::vector<std::string>& arguments, std::ostream& out) {
  CLI::App root(
      "Lumel bakes lightmaps for game levels: path-traced light into three maps per page (radiosity normal mapping).",
      "lumel");
  const auto formatter = std::make_shared<HelpFormatter>();
  root.formatter(formatter);
  root.require_subcommand(1);
  root.set_version_flag("--version", std::string("lumel ") + kVersion, "Print the version and stop");
  root.footer(
      "A level from start to picture:\n"
      "  lumel bake level.gltf -o out/level --sky-color 0.4 0.6 1\n"
      "  lumel render out/level -o out/level.png\n"
      "\n"
      "lumel COMMAND --help explains a command. Exit codes: 0 done, 1 failed, 2 wrong command line or config,\n"
      "3 wrong input, 130 interrupted.");

  std::vector<std::unique_ptr<Parsed>> commands;
  std::set<std::string> names;
  for (auto make : {bakeCommand, renderCommand, infoCommand, diffCommand}) {
    commands.push_back(std::make_unique<Parsed>());
    commands.back()->command = make();
    names.insert(commands.back()->command.name);
    declare(*commands.back(), root, formatter);
  }

  const auto chosen = [&]() -> Parsed* {
    for (const auto& parsed : commands)
      if (parsed->app->parsed()) return parsed.get();
    return nullptr;
  };
  try {
    root.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    const Parsed* parsed = chosen();
    out << (parsed ? parsed->app->help() : root.help());
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
  CommandContext context{progress, out, parsed.quiet, parsed.command.options.resolved()};
  return parsed.command.run(context);
}

}  // namespace lumel
