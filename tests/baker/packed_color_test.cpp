#include "baker/gather/waves/packed_color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/base/sobol.h"

namespace lumel {
namespace {

// Thirteen bits behind the first one: at most half of the last of them is lost.
constexpr float kMostError = 0x1p-14f;

TEST(PackedColor, KeepsLightOfAnyBrightness) {
  for (std::uint32_t i = 0; i < 10000; ++i) {
    const Vec3 light = {std::exp2(-100.0f + 0.02f * static_cast<float>(i)) * (1.0f + unitFloat(hashBits(i))),
                        unitFloat(hashBits(i + 1)), 1e6f * unitFloat(hashBits(i + 2))};
    const Vec3 back = unpackColor(packColor(light));
    for (int k = 0; k < 3; ++k) ASSERT_LE(std::abs(back[k] - light[k]), kMostError * light[k]) << i << ' ' << k;
  }
}

TEST(PackedColor, IsFreeOfBias) {
  Vec3d sum(0), back(0);
  constexpr std::uint32_t kCount = 1 << 16;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Vec3 light = {unitFloat(hashBits(i)), 10.0f * unitFloat(hashBits(~i)), 0.1f + unitFloat(hashBits(i * 3))};
    sum += Vec3d(light);
    back += Vec3d(unpackColor(packColor(light)));
  }
  // Errors up to 2^-14 that are independent leave 2^-14 / sqrt(3 * 2^16); four times as much.
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(back[k] / sum[k], 1.0, 4.0 * 0x1p-14 / std::sqrt(3.0 * kCount));
}

TEST(PackedColor, KeepsWhatHasFewBitsExactly) {
  for (const Vec3& light : {Vec3(0.0f), Vec3(1.0f, 0.5f, 0.25f), Vec3(0.0f, 1024.0f, 3.0f), Vec3(1.0f + 0x1p-13f)})
    EXPECT_EQ(unpackColor(packColor(light)), light);
}

TEST(PackedColor, RoundsUpIntoTheNextPowerOfTwo) {
  EXPECT_EQ(unpackColor(packColor(Vec3(2.0f - 0x1p-20f))), Vec3(2.0f));
}

TEST(PackedColor, SaysWhatIsNoLight) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const Vec3 back = unpackColor(packColor({-1.0f, infinity, nan}));
  EXPECT_EQ(back.x, 0.0f);
  EXPECT_EQ(back.y, infinity);
  EXPECT_FALSE(std::isfinite(back.z));
}

}  // namespace
}  // namespace lumel
