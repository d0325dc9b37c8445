#include "ssbump/maps/weights.h"

#include <gtest/gtest.h>

#include "lightmap/maps/rnm_basis.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

const std::vector<Vec3> kNormals = [] {
  std::vector<Vec3> all;
  for (int i = 0; i < 40; ++i) {
    // Up to 33 degrees off flat: all three basis vectors see the normal (35.3 is where one stops).
    const float phi = static_cast<float>(i) * 2.4f, tilt = static_cast<float>(i) / 40 * 0.58f;
    all.emplace_back(std::sin(tilt) * std::cos(phi), std::sin(tilt) * std::sin(phi), std::cos(tilt));
  }
  return all;
}();

TEST(Weights, FlatValuesOfEachConvention) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(normalWeights(Vec3(0, 0, 1), Convention::Squared)[i], 1.0 / 3, 1e-6);
    EXPECT_NEAR(normalWeights(Vec3(0, 0, 1), Convention::Linear)[i], 1 / std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(normalWeights(Vec3(0, 0, 1), Convention::Mod2x)[i], 0.5, 1e-6);
  }
}

TEST(Weights, AgreeWithTheDecodeOfTheLightmaps) {
  for (const Vec3& n : kNormals)
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(normalWeights(n, Convention::Squared)[i], rnmWeights(n, RnmDecode::Squared)[i], 1e-6);
      EXPECT_NEAR(normalWeights(n, Convention::Linear)[i], rnmWeights(n, RnmDecode::Linear)[i], 1e-6);
    }
}

TEST(Weights, AnyNumberOfDirectionsSumsToOne) {
  const std::vector<Vec3> basis{{0, 0, 1}, {0.6f, 0, 0.8f}, {-0.6f, 0, 0.8f}, {0, 0.8f, 0.6f}, {0, -0.8f, 0.6f}};
  std::vector<float> w(5);
  for (const Vec3& n : kNormals) {
    normalWeights(n, Convention::Squared, basis, w);
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3] + w[4], 1, 1e-6);
  }
}

TEST(Weights, RecoverTheNormalInEveryConvention) {
  for (const Vec3& n : kNormals)
    for (Convention c : {Convention::Squared, Convention::Linear, Convention::Mod2x})
      for (float shadow : {1.0f, 0.3f}) {
        const Vec3 r = recoveredNormal(normalWeights(n, c) * shadow, c);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(r[k], n[k], 2e-6);
      }
  EXPECT_EQ(recoveredNormal(Vec3(0)), Vec3(0, 0, 1));
}

TEST(Weights, ConversionIsExactForEvenShadows) {
  for (const Vec3& n : kNormals)
    for (Convention from : {Convention::Squared, Convention::Linear, Convention::Mod2x})
      for (Convention to : {Convention::Squared, Convention::Linear, Convention::Mod2x}) {
        const Vec3 got = convert(normalWeights(n, from) * 0.6f, {from, Hand::Right}, {to, Hand::Right});
        const Vec3 expected = normalWeights(n, to) * 0.6f;
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(got[i], expected[i], 2e-6);
      }
}

TEST(Weights, ConversionRoundTripsAndKeepsNormalsForAnyShadow) {
  for (std::uint32_t k = 0; k < 200; ++k) {
    const Vec3 s(fields::hashUnit(k, 0, 1), fields::hashUnit(k, 1, 1), fields::hashUnit(k, 2, 1));
    for (Convention to : {Convention::Linear, Convention::Mod2x})
      for (Hand hand : {Hand::Right, Hand::Left}) {
        const Encoding other{to, hand};
        const Vec3 there = convert(s, {}, other), back = convert(there, other, {});
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], s[i], 2e-6);
        const Vec3 right = hand == Hand::Left ? Vec3(there.x, there.z, there.y) : there;
        EXPECT_NEAR(glm::dot(recoveredNormal(right, to), recoveredNormal(s)), 1, 1e-6);
      }
  }
  EXPECT_EQ(convert(Vec3(0), {}, {Convention::Linear, Hand::Right}), Vec3(0));
}

TEST(Weights, LeftHandIsTheMapOfTheNegatedGreen) {
  // Swapping G and B of an ssbump map equals negating the green channel of the normal map behind it.
  for (const Vec3& n : kNormals) {
    const Vec3 flipped = convert(normalWeights(Vec3(n.x, -n.y, n.z)), {}, {Convention::Squared, Hand::Left});
    const Vec3 plain = normalWeights(n);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(flipped[i], plain[i], 1e-6);
  }
}

TEST(Weights, DetailBlendKeepsEveryRecoveredNormal) {
  Image map(16, 16, 3), detail(8, 8, 3);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      map.setRgb(
          x, y,
          normalWeights(kNormals[static_cast<std::size_t>((x + y * 16) % 40)]) *
              Vec3(fields::hashUnit(1, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) * 0.5f + 0.5f,
                   0.7f, 0.9f));
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x)
      detail.setRgb(
          x, y,
          normalWeights(kNormals[static_cast<std::size_t>((x * 5 + y) % 40)]) * (0.3f + 0.08f * static_cast<float>(x)));
  Image blended = map;
  blendDetail(blended, detail, {}, 3);
  bool changed = false;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      EXPECT_NEAR(glm::dot(recoveredNormal(blended.rgb(x, y)), recoveredNormal(map.rgb(x, y))), 1, 1e-6);
      changed = changed || std::abs(blended.rgb(x, y).x - map.rgb(x, y).x) > 0.05f;
    }
  EXPECT_TRUE(changed);
  // A flat, open detail map changes nothing.
  Image flat(4, 4, 3, 1.0f / 3), same = map;
  blendDetail(same, flat, {}, 2);
  for (std::size_t i = 0; i < map.pixels.size(); ++i) EXPECT_NEAR(same.pixels[i], map.pixels[i], 1e-6);
}

TEST(Weights, CrossFadeIsLinearInSquaredWeights) {
  Image a(2, 1, 3), b(2, 1, 3);
  a.setRgb(0, 0, {0.5f, 0.25f, 0.25f});
  b.setRgb(0, 0, {0.1f, 0.3f, 0.6f});
  const auto mid = crossFade(a, b, {}, 0.25f);
  ASSERT_TRUE(mid);
  EXPECT_NEAR(mid->rgb(0, 0).x, 0.4f, 1e-6);
  const Encoding linear{Convention::Linear, Hand::Left};
  Image la = a, lb = b;
  convert(la, {}, linear);
  convert(lb, {}, linear);
  auto faded = crossFade(la, lb, linear, 0.25f);
  ASSERT_TRUE(faded);
  convert(*faded, linear, {});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(faded->rgb(0, 0)[i], mid->rgb(0, 0)[i], 1e-6);
  EXPECT_EQ(crossFade(a, Image(3, 1, 3), {}, 0.5f).error().kind, ErrorKind::Input);
}

TEST(Weights, AlbedoScalesChannelsAlike) {
  Image map(2, 2, 3, 0.3f), albedo(2, 2, 3, 0.5f);
  modulateByAlbedo(map, albedo);
  for (float v : map.pixels) EXPECT_NEAR(v, 0.15f, 1e-6);
}

TEST(NormalMap, DecodesBothGreensAndSurvivesBadTexels) {
  for (const Vec3& n : kNormals)
    for (Green g : {Green::Up, Green::Down}) {
      const Vec3 back = decodeNormal(encodeNormal(n, g), g);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], n[i], 1e-6);
    }
  EXPECT_LT(decodeNormal({0.5f, 1, 1}, Green::Down).y, 0);
  EXPECT_EQ(decodeNormal(Vec3(0.5f), Green::Up), Vec3(0, 0, 1));
  EXPECT_GE(decodeNormal({0.5f, 0.9f, 0.0f}, Green::Up).z, 0);
}

}  // namespace
}  // namespace lumel::ssbump
