// lumel ssbump as a subcommand.
#pragma once

#include "baker/command.h"

namespace lumel {

Command ssbumpCommand();

}  // namespace lumel
