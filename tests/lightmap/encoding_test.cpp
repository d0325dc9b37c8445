#include "lightmap/maps/encoding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "tests/mentions.h"

namespace lumel {
namespace {

std::vector<std::shared_ptr<const Encoding>> allEncodings() {
  return {rnmEncoding(Projection::Raw), rnmEncoding(Projection::Flat), rnmEncoding(Projection::Fit),
          rnmEncoding(Projection::Signed), flatEncoding(), sh1Encoding()};
}

/// What an encoding stores of light L(w) above the surface, by midpoints over the hemisphere.
template <class Light>
std::vector<Vec3> encode(const Encoding& encoding, const Light& lightFrom) {
  constexpr int kRings = 400, kAzimuths = 600;
  std::vector<Vec3d> sums(encoding.mapCount(), Vec3d(0));
  Vec3d flat(0);
  for (int ring = 0; ring < kRings; ++ring)
    for (int azimuth = 0; azimuth < kAzimuths; ++azimuth) {
      const double z = (ring + 0.5) / kRings, r = std::sqrt(1 - z * z);
      const double phi = 2 * std::numbers::pi * (azimuth + 0.5) / kAzimuths;
      const Vec3 w(Vec3d(r * std::cos(phi), r * std::sin(phi), z));
      const Vec3d light = Vec3d(lightFrom(w)) * (2.0 / (kRings * kAzimuths));  // solid angle / pi
      const MapKernels k = encoding.kernels(w);
      for (std::size_t map = 0; map < sums.size(); ++map) sums[map] += light * static_cast<double>(k[map]);
      flat += light * static_cast<double>(w.z);
    }
  std::vector<Vec3> maps(sums.begin(), sums.end());
  encoding.finish(maps, Vec3(flat));
  return maps;
}

/// Midpoints over the hemisphere are off by less than 3e-6 for what is smooth; clamped dots have a bend, and Fit's
/// kernels are a table that is within 5e-4.
constexpr double kMidpoints = 1e-5;
constexpr double kTable = 1e-3;

TEST(Encoding, NamesAndCountsAreFitForFiles) {
  for (const auto& encoding : allEncodings()) {
    EXPECT_GE(encoding->mapCount(), 1u);
    EXPECT_LE(encoding->mapCount(), kMostMaps);
    const std::set<std::string> names(encoding->mapNames().begin(), encoding->mapNames().end());
    EXPECT_EQ(names.size(), encoding->mapCount());
    for (const std::string& name : names) {
      EXPECT_NE(name, "aux");
      EXPECT_EQ(name.find_first_of("/. "), std::string::npos) << name;
      EXPECT_EQ(std::count(knownMapNames().begin(), knownMapNames().end(), name), 1) << name;
    }
    for (const char* key : {"basis", "order", "decode", "decodeFormula"})
      EXPECT_EQ(encoding->conventions().count(key), 1u) << encoding->name() << ' ' << key;
  }
}

TEST(Encoding, LanesHaveTheKernelsOfTheirDirections) {
  std::array<std::array<float, kKernelLanes>, 3> w{};
  for (std::size_t lane = 0; lane + 1 < kKernelLanes; ++lane) {  // the last is the zero of an unused lane
    const float z = 1.0f - 0.13f * static_cast<float>(lane), phi = 2.4f * static_cast<float>(lane);
    const float r = std::sqrt(1.0f - z * z);
    w[0][lane] = r * std::cos(phi);
    w[1][lane] = r * std::sin(phi);
    w[2][lane] = z;
  }
  for (const auto& encoding : allEncodings()) {
    KernelLanes lanes{};
    encoding->laneKernels(w[0].data(), w[1].data(), w[2].data(), lanes);
    for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
      const Vec3 dir(w[0][lane], w[1][lane], w[2][lane]);
      const MapKernels k = encoding->kernels(dir);
      for (std::size_t map = 0; map < encoding->mapCount(); ++map) {
        EXPECT_EQ(lanes.of[map][lane], k[map]) << encoding->name() << ' ' << map << ' ' << lane;
        if (!encoding->isSigned()) {
          EXPECT_GE(k[map], 0.0f);
        }
        if (encoding->domain() == Domain::Hemisphere && dir.z <= 0.0f) {
          EXPECT_EQ(k[map], 0.0f);
        }
      }
    }
  }
}

// A sky of radiance 1 gives 1 on the flat normal (raw: 0.788675) and (1 + N.z) / 2 on others.
TEST(Encoding, EvenSky) {
  const auto sky = [](const Vec3&) { return Vec3(1.0f); };
  const Vec3 up(0, 0, 1);
  for (const auto& encoding : allEncodings()) {
    const double truth =
        encoding->conventions().count("projection") && encoding->conventions().at("projection") == "raw"
            ? (1 + 1 / std::numbers::sqrt3) / 2
            : 1.0;
    EXPECT_NEAR(encoding->decode(encode(*encoding, sky), up).x, truth, kTable) << encoding->name();
  }
  const auto sh1 = sh1Encoding();
  const std::vector<Vec3> maps = encode(*sh1, sky);
  EXPECT_NEAR(maps[0].x, 0.5, kMidpoints);
  EXPECT_NEAR(maps[1].x, 0.0, kMidpoints);
  EXPECT_NEAR(maps[2].x, 0.0, kMidpoints);
  EXPECT_NEAR(maps[3].x, 0.5, kMidpoints);
  for (const float tilt : {0.0f, 0.3f, 0.8f, 1.5f}) {
    const Vec3 n(0.6f * std::sin(tilt), 0.8f * std::sin(tilt), std::cos(tilt));
    EXPECT_NEAR(sh1->decode(maps, n).x, (1 + n.z) / 2, kMidpoints);
  }
}

// Light along w brings 1/4 to L0 and w/2 to the vector; irradiance is max(0, N.w), of which two bands are 1/4 + N.w/2.
TEST(Encoding, TwoBandsOfALightAlongADirection) {
  const auto sh1 = sh1Encoding();
  EXPECT_TRUE(sh1->isSigned());
  const Vec3 w(0.36f, -0.48f, 0.8f);
  const MapKernels k = sh1->kernels(w);
  const std::vector<Vec3> maps = {Vec3(k[0]), Vec3(k[1]), Vec3(k[2]), Vec3(k[3])};
  for (const Vec3& n : {Vec3(0, 0, 1), Vec3(0.6f, 0, 0.8f), w})
    EXPECT_NEAR(sh1->decode(maps, n).x, 0.25f + 0.5f * glm::dot(n, w), 1e-6);  // rounding
  EXPECT_EQ(sh1->decode(maps, -w).x, 0.0f);                                    // never negative
}

TEST(Encoding, AreFoundAsFilesStateThem) {
  for (const auto& encoding : allEncodings()) {
    const auto found = findEncoding(encoding->name(), encoding->conventions());
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ((*found)->conventions(), encoding->conventions());
    EXPECT_EQ((*found)->mapNames(), encoding->mapNames());
  }
  const auto linear = findEncoding("rnm", {{"decode", "linear"}});
  ASSERT_TRUE(linear);
  const std::vector<Vec3> maps = {Vec3(3), Vec3(4), Vec3(5)};
  EXPECT_NEAR((*linear)->decode(maps, Vec3(0, 0, 1)).x, 12 / std::numbers::sqrt3, 1e-5);
  for (const auto& [name, conventions, word] :
       {std::tuple("sh9", Conventions{}, "'sh9'"), std::tuple("sh9", Conventions{}, "rnm, flat, sh1"),
        std::tuple("rnm", Conventions{{"decode", "cubed"}}, "'cubed'"),
        std::tuple("rnm", Conventions{{"projection", "round"}}, "'round'")}) {
    const auto found = findEncoding(name, conventions);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().kind, ErrorKind::Input);
    EXPECT_TRUE(mentions(found.error().message, word)) << found.error().message;
  }
}

}  // namespace
}  // namespace lumel
