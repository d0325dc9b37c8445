// What --help prints for a subcommand.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "baker/commands/command.h"

namespace lumel {

/// Usage, options by group with their defaults, examples; lines of at most 100 characters.
std::string helpText(const Command& command);

/// What an option does, with its default.
std::string explanationOf(const Option& option);
/// The options that all commands have: their names and what they do.
std::vector<std::pair<std::string, std::string>> commonOptions(const Command& command);

/// What lumel's exit codes mean, in two lines.
inline constexpr const char* kExitCodes =
    "0 done, 1 failed, 2 wrong command line or config, 3 wrong input,\n"
    "4 done but beyond a threshold that was asked for, 130 interrupted";

}  // namespace lumel
