// Where light samples go: more to what still varies, fewer to what is settled.
#include "baker/gather/waves/light_effort.h"

#include <gtest/gtest.h>

#include <vector>

namespace lumel {
namespace {

/// One strategy and the gather rays, each after `samples` samples per texel.
std::vector<LightSpread> spreads(const LightSpread& light, const LightSpread& rays) { return {light, rays}; }

TEST(LightEffort, AsManyAsGatherRaysWhileNothingIsKnown) {
  const std::vector<LightSpread> none(2);
  EXPECT_EQ(lightPower(none, 0), 0);
}

TEST(LightEffort, FollowsTheVariance) {
  const LightSpread rays{.variance = 1.0f, .unshadowed = 0.0f, .mean = 1.0f, .samples = 16.0f};
  int before = -100;
  for (const float variance : {0.0f, 1e-4f, 0.01f, 0.1f, 1.0f, 100.0f}) {
    const LightSpread light{.variance = variance, .unshadowed = 0.0f, .mean = 1.0f, .samples = 16.0f};
    const int power = lightPower(spreads(light, rays), 0);
    EXPECT_GE(power, before);
    before = power;
  }
  EXPECT_EQ(before, 2);
  LightSpread settled;
  settled.mean = 1.0f;
  settled.samples = 16.0f;
  EXPECT_EQ(lightPower(spreads(settled, rays), 0), -3);
}

// Where nothing has arrived, what might have keeps samples coming; the more have said so, the fewer.
TEST(LightEffort, HiddenLightIsStillLookedFor) {
  const LightSpread rays{.variance = 0.01f, .unshadowed = 0.0f, .mean = 0.1f, .samples = 16.0f};
  LightSpread hidden{.variance = 0.0f, .unshadowed = 100.0f, .mean = 0.0f, .samples = 8.0f};
  const int early = lightPower(spreads(hidden, rays), 0);
  hidden.samples = 4096.0f;
  const int late = lightPower(spreads(hidden, rays), 0);
  EXPECT_GE(early, 1);
  EXPECT_LT(late, early);
}

// Black texels without any variance: 0 / 0 must not decide.
TEST(LightEffort, NothingAtAll) {
  LightSpread nothing;
  nothing.samples = 8.0f;
  EXPECT_EQ(lightPower(spreads(nothing, nothing), 0), -3);
}

// Every sample number of a strategy is taken once, in aligned blocks, whatever its power.
TEST(LightEffort, ScaledStretchesJoin) {
  EXPECT_EQ(lightStretch(0), 0u);
  EXPECT_EQ(lightStretch(7), 0u);
  EXPECT_EQ(lightStretch(8), 1u);
  EXPECT_EQ(lightStretch(63), 1u);
  EXPECT_EQ(lightStretch(64), 2u);
  EXPECT_EQ(lightStretch(1u << 24), 2u);
  EXPECT_TRUE(startsLightStretch(8) && startsLightStretch(64));
  EXPECT_FALSE(startsLightStretch(0) || startsLightStretch(16) || startsLightStretch(128));
  for (int power = -3; power <= 2; ++power)
    for (std::uint32_t first = 8; first < 4096; first *= 2) {
      EXPECT_EQ(scaledBy(power, first) + scaledBy(power, first), scaledBy(power, 2 * first));
      EXPECT_GE(scaledBy(power, first), 1u);
    }
}

TEST(LightEffort, TallyOfKnownSamples) {
  LightSpread spread;
  LightTally tally;
  // Two texels, four samples each: 0 0 2 2 (variance 4/3) and 1 1 1 1.
  for (const float v : {0.0f, 0.0f, 2.0f, 2.0f}) tally.add(0, v);
  for (int i = 0; i < 4; ++i) tally.add(1, 1.0f);
  tally.unshadowed = 16.0f;
  tally.enter(spread, 4, 2);
  EXPECT_FLOAT_EQ(spread.mean, 1.0f);
  EXPECT_FLOAT_EQ(spread.variance, 2.0f / 3);
  EXPECT_FLOAT_EQ(spread.unshadowed, 2.0f);
  EXPECT_FLOAT_EQ(spread.samples, 4.0f);
  // Twelve more without light weigh three times as much.
  LightTally().enter(spread, 12, 2);
  EXPECT_FLOAT_EQ(spread.mean, 0.25f);
  EXPECT_FLOAT_EQ(spread.variance, 1.0f / 6);
  LightTally().enter(spread, 0, 2);
  LightTally().enter(spread, 4, 0);
  EXPECT_FLOAT_EQ(spread.samples, 16.0f);
}

}  // namespace
}  // namespace lumel
