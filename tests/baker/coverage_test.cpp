// The claim that a bake makes about its own error: the truth lies within 1.96 standard errors at about 95% of the
// texels, and sampling to a target error neither misses the target nor shifts the light.
#include <gtest/gtest.h>

#include <cstdio>

#include "baker/gather/waves/waves.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A room with a window to the sky, a lamp, a point light and two blocks: soft and hard shadows, light through an
/// opening, corners.
TestScene litRoom() {
  TestScene test;
  const int white = test.addMaterial(Vec3(0.7f));
  const int red = test.addMaterial({0.6f, 0.1f, 0.1f});
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(12.0f));
  const RectangleOptions big{.material = white, .texels = 16};
  test.addRectangle({0, 0, 4}, {4, 0, 0}, {0, 0, -4}, big);                              // floor
  test.addRectangle({0, 3, 0}, {4, 0, 0}, {0, 0, 4}, big);                               // ceiling
  test.addRectangle({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, big);                               // back
  test.addRectangle({0, 0, 4}, {0, 0, -4}, {0, 3, 0}, {.material = red, .texels = 16});  // left
  test.addRectangle({4, 0, 0}, {0, 0, 4}, {0, 1, 0}, big);                               // right, below the window
  test.addRectangle({4, 2.2f, 0}, {0, 0, 4}, {0, 0.8f, 0}, big);                         // and above
  test.addRectangle({4, 0, 4}, {-4, 0, 0}, {0, 3, 0}, big);                              // front
  test.addRectangle({1, 0, 2}, {1, 0, 0}, {0, 1.5f, 0}, {.material = white, .texels = 8});
  test.addRectangle({1, 1.5f, 2}, {1, 0, 0}, {0, 0, -1}, {.material = white, .texels = 8});
  test.addRectangle({2, 0, 2}, {0, 0, -1}, {0, 1.5f, 0}, {.material = white, .texels = 8});
  test.addRectangle({0.5f, 2.9f, 2.5f}, {0.6f, 0, 0}, {0, 0, 0.6f}, {.material = lamp, .texels = 0});
  test.scene.environment.color = {0.5f, 0.7f, 1.0f};
  Light point;
  point.type = LightType::Point;
  point.position = {3, 2, 3};
  point.intensity = 4.0f;
  test.scene.lights = {point};
  return test;
}

/// Luminance of every covered, valid texel with light, and what is claimed of it.
struct Texels {
  std::vector<double> light;
  std::vector<double> standardError;
  double samples = 0;
  double mean() const {
    double sum = 0;
    for (const double v : light) sum += v / static_cast<double>(light.size());
    return sum;
  }
};

Texels texelsOf(const BakeResult& result) {
  Texels texels;
  for (const BakedPage& page : result.pages)
    for (int y = 0; y < page.flat.height; ++y)
      for (int x = 0; x < page.flat.width; ++x) {
        texels.light.push_back(static_cast<double>(luminance(page.flat.rgb(x, y))));
        texels.standardError.push_back(static_cast<double>(page.aux.at(x, y)[2]));
        texels.samples += static_cast<double>(page.aux.at(x, y)[3]);
      }
  texels.samples /= static_cast<double>(texels.light.size());
  return texels;
}

/// Its error is a fifth of the candidates' and less: it adds 2% to their standard errors.
std::vector<double> reference(TestScene test, Integrator integrator) {
  test.integrator = integrator;
  constexpr int kRuns = 2;
  std::vector<double> mean;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const Texels texels =
        texelsOf(test.bake({.samples = integrator == Integrator::Path ? 1024 : 8192, .seed = 900 + seed}));
    mean.resize(texels.light.size());
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += texels.light[i] / kRuns;
  }
  return mean;
}

struct Coverage {
  double share = 0;  // of texels whose error is within 1.96 standard errors
  double bias = 0;   // of the mean over texels and seeds, relative
  double biasError = 0;
  double samples = 0;
};

Coverage coverage(TestScene test, Integrator integrator, const BakeOptions& options, const std::vector<double>& truth,
                  int seeds) {
  test.integrator = integrator;
  Coverage result;
  std::vector<double> means;
  double truthMean = 0;
  for (const double v : truth) truthMean += v / static_cast<double>(truth.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    BakeOptions seeded = options;
    seeded.seed = static_cast<std::uint64_t>(seed);
    const Texels texels = texelsOf(test.bake(seeded));
    double within = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      within += std::abs(texels.light[i] - truth[i]) <= 1.96 * texels.standardError[i];
    result.share += within / static_cast<double>(truth.size()) / seeds;
    result.samples += texels.samples / seeds;
    means.push_back(texels.mean() / truthMean - 1);
    result.bias += means.back() / seeds;
  }
  double spread = 0;
  for (const double m : means) spread += (m - result.bias) * (m - result.bias);
  result.biasError = std::sqrt(spread / (seeds - 1) / seeds);
  return result;
}

void expectCoverage(Integrator integrator, std::initializer_list<int> counts) {
  const TestScene test = litRoom();
  const std::vector<double> truth = reference(test, integrator);
  for (const int samples : counts) {
    const Coverage c = coverage(test, integrator, {.samples = samples}, truth, 8);
    std::printf("%d samples: %.1f%% of the texels within 1.96 standard errors\n", samples, 100 * c.share);
    EXPECT_GE(c.share, 0.93) << samples;
    EXPECT_LE(c.share, 0.975) << samples;  // half a per cent for eight seeds of one small room
  }
}

TEST(ErrorCoverage, Gather) { expectCoverage(Integrator::Gather, {32, 64, 256}); }

TEST(ErrorCoverage, Path) { expectCoverage(Integrator::Path, {32, 64}); }

// Sampling that stops where its estimate happens to be low takes fewer samples there; the light must not follow.
TEST(ErrorCoverage, TargetErrorIsMetAndUnbiased) {
  const TestScene test = litRoom();
  const std::vector<double> truth = reference(test, Integrator::Gather);
  double truthMean = 0;
  for (const double v : truth) truthMean += v / static_cast<double>(truth.size());
  for (const float target : {0.05f, 0.02f}) {
    const Coverage c = coverage(test, Integrator::Gather, {.samples = 32, .targetError = target}, truth, 12);
    std::printf("target %g: %.0f samples per texel, %.1f%% within 1.96 standard errors, bias %+.3f%% +- %.3f%%\n",
                static_cast<double>(target), c.samples, 100 * c.share, 100 * c.bias, 100 * c.biasError);
    EXPECT_GE(c.share, 0.92) << target;  // the price of choosing where to stop: a per cent
    EXPECT_LE(c.share, 0.98) << target;
    // The bound that README states: a tenth of the target.
    EXPECT_LE(std::abs(c.bias), 0.1 * static_cast<double>(target) + 3 * c.biasError) << target;
    EXPECT_LE(c.biasError, 0.05 * static_cast<double>(target));
  }
}

// In every direction: a pool along rows of tiles alone showed as streaks in the sample counts.
TEST(Waves, ThoseAroundLieAroundOnThePage) {
  TestScene test;
  test.addRectangle({0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {.texels = 16});  // 4 x 4 tiles, a wave each
  const Waves waves(findTexels(test.atlas));
  constexpr std::uint32_t none = Waves::kNone;
  EXPECT_EQ(waves.around(5), (std::array<std::uint32_t, 9>{0, 1, 2, 4, 5, 6, 8, 9, 10}));
  EXPECT_EQ(waves.around(0), (std::array<std::uint32_t, 9>{none, none, none, none, 0, 1, none, 4, 5}));
}

}  // namespace
}  // namespace lumel
