// The command line: finds the subcommand, fills its options (config file first, then the arguments) and runs it.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "baker/commands/command.h"
#include "scene/base/expected.h"

namespace lumel {

/// Runs `lumel ARGUMENTS...`. Nothing, help, --help and --version print to `out` and succeed. Errors: those of the
/// subcommand, and Usage for an unknown option, a missing or a wrong value.
Expected<void> runCommandLine(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace lumel
