// What a subcommand is to the command line: a name, options and something to run.
#pragma once

#include <functional>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>

#include "baker/commands/options.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

/// What a running subcommand may use of the outside.
struct CommandContext {
  Progress& progress;
  std::ostream& out;                // standard output: what the user asked to see
  bool quiet = false;               // nothing on stderr but errors
  nlohmann::ordered_json settings;  // every option of the subcommand as resolved
  const OptionTable& options;
};

/// `run` is called after all options are set. The option targets live in the closure of `run`.
struct Command {
  std::string name;
  std::string summary;   // one line
  std::string examples;  // shown under --help, with what they do
  OptionTable options;
  bool takesConfig = false;  // adds --config FILE
  std::function<Expected<void>(CommandContext&)> run;
};

Command bakeCommand();
Command ssbumpCommand();
Command renderCommand();
Command infoCommand();
Command diffCommand();
Command convertCommand();
Command exportCommand();
Command studyCommand();

}  // namespace lumel
