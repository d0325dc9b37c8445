#include "baker/gather/gather_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <sstream>
#include <string>

#include "scene/base/parallel.h"
#include "tests/baker/resumed_room.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

using namespace testing_scene;

std::string fileOf(const GatherState& state, std::uint64_t key) {
  std::ostringstream out;
  EXPECT_TRUE(writeState(state, key, out));
  return out.str();
}

Expected<GatherState> stateOf(const std::string& file, std::uint64_t key) {
  std::istringstream in(file);
  return readState(in, key);
}

/// Stops a bake after `pieces` pieces of 512 samples, a few waves each.
GatherSession stopped(const SessionRoom& room, const BakeOptions& options, int pieces) {
  GatherSession session;
  session.pauses = {.goesOn = [&](const GatherState&) { return --pieces > 0; }, .samplesPerPiece = 512};
  const auto result = room.bake(options, session);
  EXPECT_TRUE(!result && result.error().kind == ErrorKind::Interrupted);
  session.pauses = {};
  return session;
}

std::string bytesOf(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(GatherState, StoppedInItsLastPassABakeGoesOnInANewProcess) {
  const std::filesystem::path dir = scratch();
  const SessionRoom room;
  const BakeOptions options = resumedOptions();
  GatherSession whole;
  const auto uninterrupted = room.bake(options, whole);
  ASSERT_TRUE(uninterrupted);
  writeResult(*uninterrupted, dir / "whole");

  // Stops at the first pause of the pass from sample 128 on, when some of its waves are gathered and others not.
  GatherSession session;
  session.pauses = {.goesOn = [](const GatherState& state) { return state.samples < 128; }, .samplesPerPiece = 64};
  ASSERT_FALSE(room.bake(options, session));
  const GatherState& state = *session.state;
  ASSERT_EQ(state.openEnd, 130u);
  const auto taken =
      std::count_if(state.waves.begin(), state.waves.end(), [](const auto& w) { return w.samples == 130; });
  ASSERT_GT(taken, 0);
  ASSERT_LT(static_cast<std::size_t>(taken), state.waves.size());
  std::ofstream(dir / "state", std::ios::binary) << fileOf(state, room.key(options));

  for (const char* threads : {"1", "4"}) {
    const std::string command = std::string(LUMEL_RESUME_HELPER) + " '" + (dir / "state").string() + "' '" +
                                (dir / "resumed").string() + "' " + threads;
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(bytesOf(dir / "resumed"), bytesOf(dir / "whole")) << threads << " threads";
  }
}

// Stopped at every pause, written and read each time: with the result of a bake that never stopped, however many
// threads work on which piece.
TEST(GatherState, StoppedAtEveryPauseTheResultIsTheSame) {
  const SessionRoom room;
  for (const BakeOptions& options :
       {BakeOptions{.samples = 40}, BakeOptions{.samples = 24, .bounces = 2, .indirectOnly = true},
        BakeOptions{.samples = 8, .bounces = 10}, BakeOptions{.samples = 32, .targetError = 0.05f, .maxSamples = 256},
        BakeOptions{.samples = 16, .bounces = 0}}) {
    GatherSession whole;
    const auto expected = room.bake(options, whole);
    ASSERT_TRUE(expected);
    int stops = 0;
    GatherSession session;
    for (auto result = Expected<BakeResult>(interrupted()); !result; ++stops) {
      const ThreadLimit limit(stops % 3 + 1);
      session.pauses = {.goesOn = [](const GatherState&) { return false; }, .samplesPerPiece = 1024};
      result = room.bake(options, session);
      if (result) {
        EXPECT_TRUE(sameBytes(*result, *expected)) << describeBounces(options.bounces) << " bounces";
        break;
      }
      ASSERT_EQ(result.error().kind, ErrorKind::Interrupted) << result.error().message;
      auto read = stateOf(fileOf(*session.state, 5), 5);
      ASSERT_TRUE(read) << read.error().message;
      session.state = *std::move(read);
    }
    EXPECT_GE(stops, 3);
  }
}

TEST(GatherState, OtherFilesAreRefused) {
  const SessionRoom room;
  const BakeOptions options = resumedOptions();
  const std::uint64_t key = room.key(options);
  const std::string file = fileOf(*stopped(room, options, 5).state, key);
  ASSERT_TRUE(stateOf(file, key));
  const auto refuses = [](const Expected<GatherState>& state, const char* why) {
    if (state) return testing::AssertionFailure() << "was read";
    if (state.error().kind != ErrorKind::Input || state.error().message.find(why) == std::string::npos)
      return testing::AssertionFailure() << state.error().message;
    return testing::AssertionSuccess();
  };
  EXPECT_TRUE(refuses(stateOf("", key), "no state"));
  EXPECT_TRUE(refuses(stateOf("a picture, or anything else that is long enough", key), "no state"));
  for (std::size_t length = 32; length < file.size(); length += 997)
    EXPECT_TRUE(refuses(stateOf(file.substr(0, length), key), "too early")) << length;
  for (std::size_t at = 0; at < file.size(); at += 499) {
    std::string damaged = file;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x41);
    const auto state = stateOf(damaged, key);
    EXPECT_TRUE(!state && state.error().kind == ErrorKind::Input) << at;
  }
  BakeOptions other = options;
  other.seed = 8;
  EXPECT_NE(room.key(other), key);
  EXPECT_TRUE(refuses(stateOf(file, room.key(other)), "another bake"));
  std::string later = file;
  later[std::string("lumel gather state\n").size()] = 77;
  EXPECT_TRUE(refuses(stateOf(later, key), "version 77"));
}

// A state whose file is whole but that was made for other texels is refused before it is used.
TEST(GatherState, OfOtherTexelsIsRefused) {
  const SessionRoom room;
  GatherSession session = stopped(room, resumedOptions(), 5);
  session.state->sums.flat.pop_back();
  const auto result = room.bake(resumedOptions(), session);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Input);
}

}  // namespace
}  // namespace lumel
