// Invariants that stay on in every build: a failed check is a bug in Lumel, never the user's mistake.
#pragma once

namespace lumel {

/// Prints "file:line: check failed: expression" to stderr and aborts.
[[noreturn]] void checkFailed(const char* expression, const char* file, int line);

}  // namespace lumel

#define LUMEL_CHECK(condition) ((condition) ? void(0) : ::lumel::checkFailed(#condition, __FILE__, __LINE__))
