// The two back ends share the height field and nothing else: they must agree within the rays' own error.
#include <gtest/gtest.h>

#include "ssbump/occlusion/horizon.h"
#include "ssbump/occlusion/ray_occlusion.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

struct Difference {
  double rmse = 0, bias = 0;
};

/// Over some texels of the field, all lobes alike.
Difference compare(const HeightField& field, std::span<const Lobe> lobes, int rays) {
  std::vector<std::pair<int, int>> texels;
  const int step = std::max(1, field.width / 12);
  for (int y = 1; y < field.height; y += step)
    for (int x = y % step; x < field.width; x += step) texels.emplace_back(x, y);
  const int reach = 2 * std::max(field.width, field.height);
  auto rayField =
      RayOcclusion::build(field, {.count = rays, .sampling = RaySampling::Stratified, .seed = 3, .reach = reach});
  EXPECT_TRUE(rayField);
  const std::vector<float> truth = rayField->occlusionAt(texels, lobes);
  const Image o = Horizon(field, {.azimuths = 64, .reach = reach}).occlusion({0, 0, field.width, field.height}, lobes);
  Difference d;
  for (std::size_t i = 0; i < texels.size(); ++i)
    for (std::size_t c = 0; c < lobes.size(); ++c) {
      const double e = static_cast<double>(o.at(texels[i].first, texels[i].second)[c]) -
                       static_cast<double>(truth[i * lobes.size() + c]);
      d.rmse += e * e;
      d.bias += e;
    }
  const double n = static_cast<double>(truth.size());
  return {std::sqrt(d.rmse / n), d.bias / n};
}

// 2048 stratified rays err by 0.002 to 0.003 (measured against 16384), the horizons by up to 0.002.
constexpr double kRmse = 0.005, kBias = 0.002;

void expectAgreement(const HeightField& field, std::span<const Lobe> lobes, const char* what, int rays = 2048) {
  const Difference d = compare(field, lobes, rays);
  EXPECT_LT(d.rmse, kRmse) << what;
  EXPECT_LT(std::abs(d.bias), kBias) << what;
}

TEST(BackEnds, AgreeOnSmoothSharpAndSteppedFields) {
  std::vector<Lobe> lobes = rnmLobes();
  lobes.push_back(ambientLobe());
  for (float amplitude : {8.0f, 24.0f, 64.0f}) expectAgreement(fields::fractal(128, 128, amplitude), lobes, "fractal");
  expectAgreement(fields::bricks(128, 128, 24), lobes, "bricks");
  expectAgreement(fields::steps(128, 128, 24), lobes, "steps");
}

TEST(BackEnds, AgreeOnOddSizesWithAndWithoutWrap) {
  for (bool wrap : {true, false}) {
    HeightField field = fields::fractal(97, 53, 20);
    field.wrap = wrap;
    expectAgreement(field, rnmLobes(), wrap ? "wrap" : "no wrap");
  }
}

TEST(BackEnds, AgreeOnConesAndOtherBases) {
  const HeightField field = fields::fractal(96, 96, 40);
  expectAgreement(field, rnmLobes(LobeShape::Cone, 120), "cone of 120 degrees");
  // A cone of 70 degrees holds a fifth of the hemisphere's rays.
  expectAgreement(field, rnmLobes(LobeShape::Cone, 70), "cone of 70 degrees", 5 * 2048);
  std::vector<Lobe> six;
  for (int i = 0; i < 6; ++i) {
    const float phi = static_cast<float>(i) * kPi / 3;
    six.push_back({glm::normalize(Vec3(std::cos(phi), std::sin(phi), 0.7f)), LobeShape::Hemisphere, 0});
  }
  expectAgreement(field, six, "six directions");
}

TEST(BackEnds, RaysOfEverySamplingConvergeToTheSame) {
  const HeightField field = fields::fractal(64, 64, 20);
  const std::vector<std::pair<int, int>> texels{{5, 9}, {33, 40}, {60, 2}, {17, 17}};
  std::vector<std::vector<float>> results;
  for (RaySampling sampling : {RaySampling::Random, RaySampling::Stratified, RaySampling::Sobol}) {
    auto rays = RayOcclusion::build(field, {.count = 16384, .sampling = sampling, .seed = 11});
    ASSERT_TRUE(rays);
    results.push_back(rays->occlusionAt(texels, rnmLobes()));
  }
  // Random: a standard error of 0.5 / sqrt(16384) = 0.004 at most; four of them.
  for (std::size_t i = 0; i < results[0].size(); ++i) {
    EXPECT_NEAR(results[0][i], results[1][i], 0.016);
    EXPECT_NEAR(results[2][i], results[1][i], 0.002);
  }
}

TEST(BackEnds, RaysAreOpenOnFlatGroundAndDoNotLeakAtTheSeam) {
  const HeightField flat = fields::make(20, 20, true, [](int, int) { return 3.0f; });
  auto rays = RayOcclusion::build(flat, {.count = 64});
  ASSERT_TRUE(rays);
  for (float v : rays->occlusion({0, 0, 20, 20}, rnmLobes()).pixels) EXPECT_EQ(v, 1.0f);
  // At the bottom of a shaft one texel wide and 400 deep nearly nothing is left of the sky, seam or not.
  const HeightField shaft = fields::make(16, 16, true, [](int x, int y) { return x == 0 && y == 0 ? 0.0f : 400.0f; });
  auto deep = RayOcclusion::build(shaft, {.count = 4096});
  ASSERT_TRUE(deep);
  for (float v : deep->occlusion({0, 0, 1, 1}, rnmLobes()).pixels) EXPECT_LT(v, 1e-3f);
}

}  // namespace
}  // namespace lumel::ssbump
