// Man pages and shell completion, made of the tables of options: what --help says, in other forms. The build writes
// them (baker/CMakeLists.txt).
#pragma once

#include <span>
#include <string>

#include "baker/commands/command.h"

namespace lumel {

/// lumel-COMMAND.1, in roff.
std::string manPage(const Command& command);
/// lumel.1: all commands in a line each, exit codes.
std::string manPageOfAll(std::span<const Command* const> commands);

/// A completion script for bash: commands, then their options, the words of options that take one of a list, else
/// files.
std::string bashCompletion(std::span<const Command* const> commands);

}  // namespace lumel
