#include "baker/rays/sample_lanes.h"

#include <gtest/gtest.h>

namespace lumel {
namespace {

SampleLanes sixteenTexels() {
  SampleLanes lanes;
  for (int lane = 0; lane < kLanes; ++lane)
    lanes.setTexel(lane, TexelSampler(3, 1, static_cast<std::uint32_t>(lane), 9));
  return lanes;
}

// The lanes' loops are compiled for several instruction sets; all must give what one texel's sampler gives.
TEST(SampleLanes, DrawWhatEachTexelDraws) {
  SampleLanes lanes = sixteenTexels();
  for (int lane = 0; lane < kLanes; ++lane) lanes.setSample(lane, static_cast<std::uint32_t>(lane * lane));
  const UnitSquareLanes square = lanes.draw2D(5);
  const UnitLanes line = lanes.draw1D(6);
  for (int lane = 0; lane < kLanes; ++lane) {
    const TexelSampler sampler(3, 1, static_cast<std::uint32_t>(lane), 9);
    EXPECT_EQ(square[lane], sampler.get2D(static_cast<std::uint32_t>(lane * lane), 5));
    EXPECT_EQ(line.u[lane], sampler.get1D(static_cast<std::uint32_t>(lane * lane), 6));
  }
}

TEST(SampleLanes, SeedsOfHitsAreThoseOfTheirSamplers) {
  std::array<std::uint32_t, kLanes> keys{}, depths{};
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    keys[lane] = hashBits(lane);
    depths[lane] = lane / 4;
  }
  SampleLanes lanes;
  lanes.setTexels(keys.data(), depths.data());
  lanes.setSampleOfAll(7);
  const UnitLanes line = lanes.draw1D(2);
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    EXPECT_EQ(line.u[lane], TexelSampler(keys[lane], depths[lane], 0, 0).get1D(7, 2));
}

}  // namespace
}  // namespace lumel
