// resume_helper STATE RESULT THREADS: goes on with the bake of a SessionRoom from its state, and writes its result.
#include <cstdio>
#include <cstdlib>

#include "scene/base/parallel.h"
#include "tests/baker/resumed_room.h"

int main(int argc, char** argv) {
  using namespace lumel;
  if (argc != 4) return 2;
  const ThreadLimit limit(std::atoi(argv[3]));
  const testing_scene::SessionRoom room;
  const BakeOptions options = testing_scene::resumedOptions();
  std::ifstream in(argv[1], std::ios::binary);
  auto state = readState(in, room.key(options));
  if (!state) {
    std::fprintf(stderr, "%s\n", state.error().message.c_str());
    return 3;
  }
  GatherSession session;
  session.state = *std::move(state);
  const auto result = room.bake(options, session);
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  testing_scene::writeResult(*result, argv[2]);
  return 0;
}
