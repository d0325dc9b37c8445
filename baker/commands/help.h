// What --help prints for a subcommand.
#pragma once

#include <string>

#include "baker/commands/command.h"

namespace lumel {

/// Usage, options by group with their defaults, examples; lines of at most 100 characters.
std::string helpText(const Command& command);

}  // namespace lumel
