#include "lightmap/maps/rnm_basis.h"

#include <gtest/gtest.h>

namespace lumel {
namespace {

TEST(RnmBasis, IsOrthonormalAndInOrder) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(glm::dot(kRnmBasis[i], kRnmBasis[j]), i == j ? 1.0 : 0.0, 1e-6);
  // B0 points along +t, B1 towards +b, B2 towards -b; right-handed in that order.
  EXPECT_GT(kRnmBasis[0].x, 0.8f);
  EXPECT_GT(kRnmBasis[1].y, 0.7f);
  EXPECT_LT(kRnmBasis[2].y, -0.7f);
  EXPECT_NEAR(glm::dot(glm::cross(kRnmBasis[0], kRnmBasis[1]), kRnmBasis[2]), 1.0, 1e-6);
}

TEST(RnmWeights, FlatNormalReadsTheMapsEvenly) {
  const Vec3 up(0, 0, 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(rnmWeights(up)[i], 1.0 / 3, 1e-6);
    EXPECT_NEAR(rnmWeights(up, RnmDecode::LinearNormalized)[i], 1.0 / 3, 1e-6);
    EXPECT_NEAR(rnmWeights(up, RnmDecode::Linear)[i], 1 / std::sqrt(3.0), 1e-6);
  }
}

TEST(RnmWeights, BasisNormalReadsOneMapAlone) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(rnmWeights(kRnmBasis[i])[i], 1.0, 1e-6);
}

TEST(RnmWeights, NormalBelowTheSurfaceGivesZeroNotNan) { EXPECT_EQ(rnmWeights(Vec3(0, 0, -1)), Vec3(0.0f)); }

}  // namespace
}  // namespace lumel
