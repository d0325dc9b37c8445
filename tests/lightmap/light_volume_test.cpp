#include "lightmap/volume/light_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lumel {
namespace {

std::vector<Vec3> evenDirections(int count) {
  std::vector<Vec3> directions;  // a spherical Fibonacci lattice
  for (int i = 0; i < count; ++i) {
    const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(count);
    const float phi = 2.39996323f * static_cast<float>(i), r = std::sqrt(1.0f - z * z);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

/// A volume of one cell of 1 m whose eight points know the light of these directions.
LightVolume cellLitFrom(const std::vector<Vec3>& directions, float radiance) {
  const double share = 4.0 * static_cast<double>(kPi * radiance) / static_cast<double>(directions.size());
  std::array<double, kHarmonics> y{};
  std::array<double, kCubeFaces> faces{};
  for (const Vec3& w : directions) {
    for (std::size_t k = 0; k < kHarmonics; ++k) y[k] += share * static_cast<double>(harmonics(w)[k]);
    for (std::size_t k = 0; k < kCubeFaces; ++k) faces[k] += share * static_cast<double>(cubeKernels(w)[k]);
  }
  LightVolume volume = volumeOf(Vec3(0.0f), Vec3(1.0f), 1.0f);
  for (VolumePoint& point : volume.points) {
    point.isValid = true;
    for (std::size_t k = 0; k < kHarmonics; ++k) point.harmonics[k] = Vec3(static_cast<float>(y[k]));
    for (std::size_t k = 0; k < kCubeFaces; ++k) point.cube[k] = Vec3(static_cast<float>(faces[k]));
  }
  return volume;
}

TEST(LightVolume, HarmonicsAreOrthonormal) {
  // The lattice integrates polynomials of this degree to 1e-5.
  const std::vector<Vec3> directions = evenDirections(20000);
  for (std::size_t a = 0; a < kHarmonics; ++a)
    for (std::size_t b = 0; b < kHarmonics; ++b) {
      double sum = 0.0;
      for (const Vec3& w : directions)
        sum += static_cast<double>(harmonics(w)[a] * harmonics(w)[b]) * 4.0 * static_cast<double>(kPi) / 20000.0;
      EXPECT_NEAR(sum, a == b ? 1.0 : 0.0, 1e-4) << a << " " << b;
    }
}

// Radiance 1 from everywhere is irradiance / pi of 1 on every normal, in all bases, and for what has no normal.
TEST(LightVolume, EvenLight) {
  const LightVolume volume = cellLitFrom(evenDirections(100000), 1.0f);
  const VolumeLookup lookup = lookUp(volume, Vec3(0.3f, 0.6f, 0.1f), Vec3(0.0f), VolumeMask::None);
  for (const VolumeBasis basis : {VolumeBasis::Cube, VolumeBasis::Sh1, VolumeBasis::Sh2})
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, -1, 0), glm::normalize(Vec3(1, 2, -2)), Vec3(0.0f)})
      EXPECT_NEAR(lightOn(volume, lookup, n, basis).x, 1.0f, 1e-4f) << nameOf(basis);
}

// Light of irradiance 4 pi from one direction d: 4 max(0, n.d), of which two bands are 1 + 2 n.d and the third adds
// 5/8 (3 (n.d)^2 - 1). The cube is right on its faces.
TEST(LightVolume, OneDirection) {
  const Vec3 d = glm::normalize(Vec3(1, 2, 2));
  const LightVolume volume = cellLitFrom({d}, 1.0f);
  const VolumeLookup lookup = lookUp(volume, Vec3(0.5f), Vec3(0.0f), VolumeMask::None);
  for (const Vec3& n : {d, Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -1)}) {
    const float c = glm::dot(n, d);
    const float sh1 = 1.0f + 2.0f * c, sh2 = sh1 + 5.0f / 8.0f * (3.0f * c * c - 1.0f);
    EXPECT_NEAR(lightOn(volume, lookup, n, VolumeBasis::Sh1).x, std::max(0.0f, sh1), 1e-5f);
    EXPECT_NEAR(lightOn(volume, lookup, n, VolumeBasis::Sh2).x, std::max(0.0f, sh2), 1e-5f);
    if (n != d) {
      EXPECT_NEAR(lightOn(volume, lookup, n, VolumeBasis::Cube).x, 4.0f * std::max(0.0f, c), 1e-5f);
    }
  }
}

TEST(LightVolume, GridsFillTheirBoxes) {
  const LightVolume volume = volumeOf(Vec3(-1, 0, 2), Vec3(1, 0, 3.2f), 0.5f);
  EXPECT_EQ(volume.counts, (std::array<int, 3>{5, 1, 4}));
  EXPECT_EQ(volume.points.size(), 20u);
  EXPECT_EQ(static_cast<double>(volume.points.size()), pointCount(Vec3(-1, 0, 2), Vec3(1, 0, 3.2f), 0.5f));
  EXPECT_LT(glm::length(volume.gridPoint(19) - Vec3(1, 0, 3.2f)), 1e-5f);
  // 0.3 / 0.1 in floats is a little more than 3.
  EXPECT_EQ(volumeOf(Vec3(0.0f), Vec3(0.3f), 0.1f).counts, (std::array<int, 3>{4, 4, 4}));
}

TEST(LightVolume, LookupsAreLinearBetweenPoints) {
  LightVolume volume = volumeOf(Vec3(0.0f), Vec3(2.0f), 1.0f);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const Vec3 at = volume.gridPoint(i);
    volume.points[i].isValid = true;
    volume.points[i].cube.fill(Vec3(1.0f + at.x + 2.0f * at.y + 4.0f * at.z));
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<float> within(0.0f, 2.0f);
  for (int i = 0; i < 100; ++i) {
    const Vec3 p(within(random), within(random), within(random));
    for (const VolumeMask mask : {VolumeMask::None, VolumeMask::Sight}) {
      const VolumeLookup lookup = lookUp(volume, p, Vec3(0.0f), mask);
      EXPECT_NEAR(lightOn(volume, lookup, Vec3(0, 1, 0), VolumeBasis::Cube).x, 1.0f + p.x + 2.0f * p.y + 4.0f * p.z,
                  1e-5f);
    }
  }
  // Outside, the rim.
  const VolumeLookup outside = lookUp(volume, Vec3(-5, 1, 1), Vec3(0.0f), VolumeMask::None);
  EXPECT_NEAR(lightOn(volume, outside, Vec3(0, 1, 0), VolumeBasis::Cube).x, 7.0f, 1e-5f);
}

// Sights are read at their middles as they were stored, in all directions and across the folds of the map.
TEST(LightVolume, PlacesBehindWhatIsSeenDoNotCount) {
  LightVolume volume = volumeOf(Vec3(0.0f), Vec3(1, 0, 0), 1.0f);
  for (VolumePoint& point : volume.points) point.isValid = true;
  volume.points[0].cube.fill(Vec3(1.0f));
  // A wall from x = 0.3 to 0.4, seen from both sides.
  for (std::size_t i = 0; i < kSights; ++i) {
    volume.points[0].nearness[i] = std::max(0.0f, sightDirection(i).x / 0.3f);
    volume.points[1].nearness[i] = std::max(0.0f, -sightDirection(i).x / 0.6f);
  }
  const auto at = [&](float x, VolumeMask mask) {
    return lightOn(volume, lookUp(volume, Vec3(x, 0, 0), Vec3(0.0f), mask), Vec3(0, 1, 0), VolumeBasis::Cube).x;
  };
  EXPECT_NEAR(at(0.25f, VolumeMask::Sight), 1.0f, 1e-5f);
  EXPECT_NEAR(at(0.45f, VolumeMask::Sight), 0.0f, 1e-5f);
  EXPECT_NEAR(at(0.45f, VolumeMask::None), 0.55f, 1e-5f);
}

TEST(LightVolume, InvalidPointsTakeTheLightAround) {
  LightVolume volume = volumeOf(Vec3(0.0f), Vec3(4, 0, 0), 1.0f);
  volume.points[0].isValid = true;
  volume.points[0].cube.fill(Vec3(1.0f));
  volume.points[4].isValid = true;
  volume.points[4].cube.fill(Vec3(3.0f));
  fillInvalid(volume);
  EXPECT_EQ(volume.points[1].cube[0].x, 1.0f);
  EXPECT_EQ(volume.points[2].cube[0].x, 2.0f);
  EXPECT_EQ(volume.points[3].cube[5].x, 3.0f);
  EXPECT_FALSE(volume.points[2].isValid);
}

}  // namespace
}  // namespace lumel
