#include "ssbump/occlusion/lobe.h"

#include <gtest/gtest.h>

#include "lightmap/maps/rnm_basis.h"

namespace lumel::ssbump {
namespace {

/// The slice integral by the midpoint rule, from the definition alone.
double sliceByQuadrature(const Lobe& lobe, double phi, double t) {
  constexpr int kSteps = 40000;
  const double lo = std::atan(t), width = std::numbers::pi / 2 - lo;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double e = lo + (i + 0.5) / kSteps * width;
    const Vec3 w(static_cast<float>(std::cos(e) * std::cos(phi)), static_cast<float>(std::cos(e) * std::sin(phi)),
                 static_cast<float>(std::sin(e)));
    sum += static_cast<double>(lobeWeight(lobe, w)) * std::cos(e);
  }
  return sum * width / kSteps;
}

TEST(LobeSlice, ClosedFormEqualsItsDefinition) {
  std::vector<Lobe> lobes = rnmLobes();
  for (float opening : {30.0f, 90.0f, 120.0f, 180.0f})
    for (const Lobe& lobe : rnmLobes(LobeShape::Cone, opening)) lobes.push_back(lobe);
  lobes.push_back(ambientLobe());
  lobes.push_back({glm::normalize(Vec3(0.9f, -0.3f, 0.05f)), LobeShape::Hemisphere, 0});
  for (const Lobe& lobe : lobes)
    for (double phi : {0.1, 1.3, 2.9, 4.0, 5.7})
      for (double t : {0.0, 0.2, 1.0, 1.6, 7.0})
        // 4e-5: the quadrature's own error at a cone's sharp edge, one step of its 40000.
        EXPECT_NEAR(LobeSlice(lobe, phi).above(t), sliceByQuadrature(lobe, phi, t), 4e-5)
            << "axis " << lobe.axis.x << " opening " << lobe.coneOpeningDegrees << " phi " << phi << " t " << t;
}

TEST(LobeSlice, OpenHemisphereIntegralsAreTheKnownOnes) {
  // Over the upper hemisphere: Integral max(0, w.B) = pi (1 + B.n) / 2, for the normal itself pi.
  for (const Lobe& lobe : {rnmLobes()[0], rnmLobes()[1], rnmLobes()[2], ambientLobe()}) {
    double sum = 0;
    constexpr int kSlices = 4096;
    for (int j = 0; j < kSlices; ++j) sum += LobeSlice(lobe, sliceAzimuth(j, kSlices)).above(0);
    const double expected = std::numbers::pi * (1 + static_cast<double>(lobe.axis.z)) / 2;
    EXPECT_NEAR(sum * 2 * std::numbers::pi / kSlices, expected, 1e-5);
  }
}

TEST(LobeSlice, AConeBeyondItsEdgeIsEmptyAndAHalfSphereConeIsTheHemisphere) {
  const Lobe narrow{{0, 0, 1}, LobeShape::Cone, 20};
  EXPECT_EQ(LobeSlice(narrow, 0.3).above(0), LobeSlice(narrow, 0.3).above(1.0));  // nothing of it below 45 degrees
  EXPECT_GT(LobeSlice(narrow, 0.3).above(1.0), 0);
  const Lobe away{glm::normalize(Vec3(1, 0, 0.2f)), LobeShape::Cone, 40};
  EXPECT_EQ(LobeSlice(away, std::numbers::pi).above(0), 0);
  const Lobe wide{kRnmBasis[1], LobeShape::Cone, 180}, hemisphere{kRnmBasis[1], LobeShape::Hemisphere, 0};
  for (double t : {0.0, 0.5, 3.0})
    EXPECT_NEAR(LobeSlice(wide, 2.2).above(t), LobeSlice(hemisphere, 2.2).above(t), 1e-6);
}

}  // namespace
}  // namespace lumel::ssbump
