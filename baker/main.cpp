#include <cstdio>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "baker/commands/command_line.h"

namespace {

int exitCode(lumel::ErrorKind kind) {
  switch (kind) {
    case lumel::ErrorKind::Failed:
      return 1;
    case lumel::ErrorKind::Usage:
      return 2;
    case lumel::ErrorKind::Input:
      return 3;
    case lumel::ErrorKind::Threshold:
      return 4;
    case lumel::ErrorKind::Interrupted:
      return 130;
  }
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const auto done = lumel::runCommandLine(std::vector<std::string>(argv + 1, argv + argc), std::cout);
    std::cout.flush();
    if (!done) {
      std::fprintf(stderr, "lumel: %s\n", done.error().message.c_str());
      return exitCode(done.error().kind);
    }
    if (!std::cout) {
      std::fputs("lumel: standard output cannot be written\n", stderr);
      return 1;
    }
    return 0;
  } catch (const std::bad_alloc&) {
    std::fputs("lumel: out of memory; use a smaller page, fewer texels per metre or fewer threads\n", stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lumel: internal error: %s\n", error.what());
  }
  return 1;
}
