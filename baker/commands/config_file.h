// Options from a TOML file. The one door to toml++.
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "baker/commands/options.h"
#include "scene/base/expected.h"

namespace lumel {

/// Sets the options of `command` from `file`: top-level keys, or keys of a table named like the command (which may
/// stand beside tables of other commands, named in `allCommands`). Keys are option names without dashes in front.
/// The command line is applied after this, so it wins, and every value here is checked whether it is used or not.
/// Errors: Usage, naming file and line: an unreadable file, a syntax error, an unknown key, a wrong value.
Expected<void> applyConfig(const std::filesystem::path& file, const std::string& command,
                           const std::set<std::string>& allCommands, OptionTable& options);

}  // namespace lumel
