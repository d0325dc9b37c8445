#include <gtest/gtest.h>

#include <filesystem>

#include "scene/base/sobol.h"
#include "scene/images/environment.h"
#include "scene/images/image_io.h"
#include "scene/images/texture.h"
#include "tests/mentions.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

/// 2 x 2, RGBA: 0 and 1 with alpha 0.2 above, 0.4 and 0.6 below, grey (as 8-bit fractions).
ImageSource checker() {
  Image image(2, 2, 4);
  const float grey[] = {0.0f, 1.0f, 0.4f, 0.6f};
  for (int i = 0; i < 4; ++i) {
    image.setRgb(i % 2, i / 2, Vec3(grey[i]));
    image.at(i % 2, i / 2)[3] = i == 1 ? 0.2f : 1.0f;
  }
  return {"checker", "image/png", *encodePng(image)};
}

Texture decoded(const ImageSource& source, ColorSpace space) {
  auto texture = Texture::decode(source, space);
  EXPECT_TRUE(texture) << texture.error().message;
  return *std::move(texture);
}

TEST(Texture, SrgbDecodesColoursNotAlpha) {
  const Texture srgb = decoded(checker(), ColorSpace::Srgb), linear = decoded(checker(), ColorSpace::Linear);
  EXPECT_FLOAT_EQ(srgb.fetch(0, 1).x, srgbToLinear(0.4f));
  EXPECT_FLOAT_EQ(linear.fetch(0, 1).x, 0.4f);
  EXPECT_FLOAT_EQ(srgb.fetch(1, 0).w, 0.2f);
  EXPECT_EQ(srgb.bytes(), 16u);  // 8 bits stay 8 bits
  EXPECT_EQ(decoded({"white", "", *encodePng(Image(2, 2, 4, 1.0f))}, ColorSpace::Srgb).bytes(), 12u);  // opaque
}

TEST(Texture, GreyReplicatesAndAlphaIsOne) {
  Image grey(1, 1, 1, 0.6f);
  EXPECT_EQ(decoded({"grey", "", *encodePng(grey)}, ColorSpace::Linear).fetch(0, 0), Vec4(0.6f, 0.6f, 0.6f, 1));
  Image greyAlpha(1, 1, 2, 0.6f);
  greyAlpha.pixels[1] = 0.2f;
  EXPECT_EQ(decoded({"ga", "", *encodePng(greyAlpha)}, ColorSpace::Linear).fetch(0, 0), Vec4(0.6f, 0.6f, 0.6f, 0.2f));
}

TEST(Texture, BilinearMeetsTexelCentresAndMeansBetween) {
  const Texture t = decoded(checker(), ColorSpace::Linear);
  TextureRef clamp;
  clamp.wrapU = clamp.wrapV = Wrap::Clamp;
  EXPECT_FLOAT_EQ(t.sample(clamp, {0.25f, 0.25f}).x, 0.0f);
  EXPECT_FLOAT_EQ(t.sample(clamp, {0.75f, 0.75f}).x, 0.6f);
  EXPECT_FLOAT_EQ(t.sample(clamp, {0.5f, 0.25f}).x, 0.5f);
  EXPECT_FLOAT_EQ(t.sample(clamp, {0.5f, 0.5f}).x, 0.5f);
  EXPECT_FLOAT_EQ(t.sample(clamp, {-5.0f, 0.25f}).x, 0.0f);
  EXPECT_FLOAT_EQ(t.sample(clamp, {5.0f, 0.25f}).x, 1.0f);
}

// Clear on the left, opaque on the right and a ramp between, in an image that is no whole number of blocks.
TEST(Texture, AlphaAloneIsThatOfTheSample) {
  Image image(45, 21, 4, 1.0f);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.at(x, y)[3] = x < 20 ? 0.0f : x < 23 ? 0.2f * static_cast<float>(x - 19) : y == 20 && x == 44 ? 0.0f : 1.0f;
  const Texture t = decoded({"ramp", "image/png", *encodePng(image)}, ColorSpace::Srgb);
  EXPECT_FALSE(t.opaque());
  TextureRef ref;
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Mirror, Wrap::Clamp})
    for (const bool nearest : {false, true}) {
      ref.wrapU = ref.wrapV = wrap;
      ref.nearest = nearest;
      for (int i = 0; i < 300; ++i)
        for (int k = 0; k < 40; ++k) {
          const Vec2 uv(-0.5f + 0.0067f * static_cast<float>(i), -0.5f + 0.051f * static_cast<float>(k));
          ASSERT_NEAR(t.sampleAlpha(ref, uv), t.sample(ref, uv).w, 1e-6f) << uv.x << ", " << uv.y;
        }
    }
}

TEST(Texture, KnowsWhetherItIsOpaque) {
  Image image(9, 9, 4, 1.0f);
  EXPECT_TRUE(decoded({"white", "", *encodePng(image)}, ColorSpace::Srgb).opaque());
  EXPECT_TRUE(decoded({"grey", "", *encodePng(Image(9, 9, 1, 0.5f))}, ColorSpace::Srgb).opaque());
  image.at(8, 8)[3] = 0.99f;
  EXPECT_FALSE(decoded({"hole", "", *encodePng(image)}, ColorSpace::Srgb).opaque());
}

TEST(Texture, WrapModes) {
  const Texture t = decoded(checker(), ColorSpace::Linear);
  TextureRef ref;
  ref.nearest = true;
  const auto at = [&](Wrap mode, float u) {
    ref.wrapU = mode;
    return t.sample(ref, {u, 0.1f}).x;
  };
  EXPECT_EQ(at(Wrap::Repeat, 1.1f), 0);
  EXPECT_EQ(at(Wrap::Repeat, -0.1f), 1);
  EXPECT_EQ(at(Wrap::Mirror, 1.1f), 1);
  EXPECT_EQ(at(Wrap::Mirror, -0.1f), 0);
  EXPECT_EQ(at(Wrap::Mirror, 2.1f), 0);
  EXPECT_EQ(at(Wrap::Clamp, 9.0f), 1);
  ref.nearest = false;
  ref.wrapU = Wrap::Repeat;
  EXPECT_FLOAT_EQ(t.sample(ref, {0.0f, 0.25f}).x, 0.5f);  // across the seam
}

TEST(Texture, TransformAppliesAndWildCoordinatesAreHarmless) {
  const Texture t = decoded(checker(), ColorSpace::Linear);
  TextureRef ref;
  ref.nearest = true;
  ref.uvMatrix = Mat3(Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.5f, 0, 1));
  EXPECT_EQ(t.sample(ref, {0.1f, 0.1f}).x, 1);
  ref.nearest = false;
  for (const float wild : {1e30f, -1e30f, NAN, INFINITY}) EXPECT_TRUE(std::isfinite(t.sample(ref, {wild, wild}).x));
}

TEST(Texture, HalvedIsTheMeanOfLinearValues) {
  const Texture srgb = decoded(checker(), ColorSpace::Srgb);
  const Texture half = srgb.halved();
  EXPECT_EQ(half.width(), 1);
  EXPECT_EQ(half.height(), 1);
  const float mean = (0.0f + 1.0f + srgbToLinear(0.4f) + srgbToLinear(0.6f)) / 4.0f;
  EXPECT_NEAR(half.fetch(0, 0).x, mean, 0.005f);                         // a step of 8 bits at this level
  EXPECT_NEAR(half.fetch(0, 0).w, (0.2f + 3.0f) / 4.0f, 1.0f / 255.0f);  // alpha is linear
  // Odd sizes: the middle texel of five counts half to either side.
  Image ramp(5, 1, 1);
  for (int x = 0; x < 5; ++x) ramp.at(x, 0)[0] = static_cast<float>(x) / 5.0f;
  const Texture odd = decoded({"ramp", "", *encodePng(ramp)}, ColorSpace::Linear).halved();
  ASSERT_EQ(odd.width(), 2);
  EXPECT_NEAR(odd.fetch(0, 0).x, (0.0f + 0.2f + 0.5f * 0.4f) / 2.5f, 1.0f / 255.0f);
  EXPECT_NEAR(odd.fetch(1, 0).x, (0.5f * 0.4f + 0.6f + 0.8f) / 2.5f, 1.0f / 255.0f);
}

TEST(Texture, HalvedAtTheWidestThatIsRead) {
  Image strip(65536, 1, 1);
  for (int x = 0; x < strip.width; ++x) strip.at(x, 0)[0] = x < 65533 ? 0.0f : 1.0f;
  const Texture half = decoded({"strip", "", *encodePng(strip)}, ColorSpace::Linear).halved();
  ASSERT_EQ(half.width(), 32768);
  EXPECT_EQ(half.fetch(32765, 0).x, 0.0f);
  EXPECT_NEAR(half.fetch(32766, 0).x, 0.5f, 0.01f);
  EXPECT_EQ(half.fetch(32767, 0).x, 1.0f);
}

// Rounding each texel for itself would add a thousandth per level, to what bakes take for the mean of a material.
TEST(Texture, HalvingKeepsTheMean) {
  Image plaster(256, 256, 3);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x)
      plaster.setRgb(
          x, y,
          Vec3(0.5f + 0.02f * unitFloat(hashCombine(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)))));
  const auto mean = [](const Texture& texture) {
    double sum = 0.0;
    for (int y = 0; y < texture.height(); ++y)
      for (int x = 0; x < texture.width(); ++x) sum += static_cast<double>(texture.fetch(x, y).x);
    return sum / (texture.width() * texture.height());
  };
  Texture level = decoded({"plaster", "", *encodePng(plaster)}, ColorSpace::Srgb);
  const double whole = mean(level);
  // What is left over at the end of each row, at most half a step of about 0.8%, cancels from row to row.
  for (; level.width() > 16; level = level.halved()) EXPECT_NEAR(mean(level) / whole, 1.0, 2e-4) << level.width();
}

TEST(TexturePyramid, WideLookupsSeeTheMean) {
  Image stripes(64, 64, 3);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) stripes.setRgb(x, y, Vec3(x % 2 == 0 ? 1.0f : 0.0f));
  const TexturePyramid pyramid(decoded({"stripes", "", *encodePng(stripes)}, ColorSpace::Linear));
  TextureRef ref;
  const Vec2 white{0.5f / 64.0f, 0.5f};
  EXPECT_EQ(pyramid.sample(ref, white, 0.0f).x, 1.0f);
  EXPECT_EQ(pyramid.sample(ref, white, 1.0f / 64.0f).x, 1.0f);
  EXPECT_NEAR(pyramid.sample(ref, white, 2.0f / 64.0f).x, 0.5f, 0.005f);
  const float between = pyramid.sample(ref, white, 1.5f / 64.0f).x;
  EXPECT_GT(between, 0.6f);
  EXPECT_LT(between, 0.9f);
  ref.uvMatrix[0][0] = ref.uvMatrix[1][1] = 2.0f;  // the map twice as often: texels are half as wide
  EXPECT_NEAR(pyramid.sample(ref, white, 1.0f / 64.0f).x, 0.5f, 0.005f);
  for (const float wild : {1e30f, INFINITY, NAN}) EXPECT_TRUE(std::isfinite(pyramid.sample(ref, white, wild).x));
}

TEST(Texture, MissingAndBrokenImagesAreErrors) {
  EXPECT_EQ(Texture::decode({"gone", "", {}}, ColorSpace::Srgb).error().message, "gone: the image is missing");
  // No cut PNG here: the library's own reader leaks its error text on one (scene_foundation_test has that case).
  const ImageSource cut{"cut", "image/jpeg", {0xFF, 0xD8, 0xFF, 0xE0, 0, 16, 'J', 'F', 'I', 'F'}};
  auto result = Texture::decode(cut, ColorSpace::Srgb);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::Input);
}

TEST(Environment, OrientationAsDocumented) {
  Environment e;
  e.image = Image(4, 2, 3);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 2; ++y) e.image.setRgb(x, y, Vec3(static_cast<float>(x), static_cast<float>(y), 0));
  e.strength = 2;
  // u = 0.5 + atan2(z, x) / 2pi: the texel x = 2 spans +x towards +z, its centre is 45 degrees between.
  const float h = std::sqrt(0.5f);
  const auto at = [&](const Vec3& d) { return environmentRadiance(e, d); };
  EXPECT_NEAR(at({h, 0, h}).x, 2 * 2, 1e-5);
  EXPECT_NEAR(at({-h, 0, h}).x, 2 * 3, 1e-5);
  EXPECT_NEAR(at({-h, 0, -h}).x, 2 * 0, 1e-5);
  EXPECT_NEAR(at({h, 0, -h}).x, 2 * 1, 1e-5);
  EXPECT_NEAR(at({-1, 0, 0}).x, 2 * 1.5f, 1e-5);  // wraps: the mean of texels 3 and 0
  EXPECT_NEAR(at({0, 1, 0}).y, 0, 1e-5);          // the top row is up, clamped at the pole
  EXPECT_NEAR(at({0, -1, 0}).y, 2 * 1, 1e-5);
  // A quarter turn counter-clockwise seen from above takes +x to -z: what stood at +x+z now stands at +x-z.
  e.rotationDegrees = 90;
  EXPECT_NEAR(at({h, 0, -h}).x, 2 * 2, 1e-5);
  e.rotationDegrees = -630;  // the same turn
  EXPECT_NEAR(at({h, 0, -h}).x, 2 * 2, 1e-5);
  e.image = {};
  e.color = {1, 2, 3};
  EXPECT_EQ(at({0, 1, 0}), Vec3(2, 4, 6));
}

TEST(Environment, FilesAreCheckedPixelByPixel) {
  const fs::path folder = scratch();
  Image sky(4, 2, 3, 1.5f);
  ASSERT_TRUE(writeImage(folder / "good.exr", sky));
  ASSERT_TRUE(writeImage(folder / "good.hdr", sky));
  for (const char* name : {"good.exr", "good.hdr"}) {
    auto good = loadEnvironment(folder / name);
    ASSERT_TRUE(good) << good.error().message;
    EXPECT_EQ(good->image.rgb(3, 1), Vec3(1.5f));
  }
  for (const float bad : {-1.0f, INFINITY}) {
    sky.at(2, 1)[1] = bad;
    ASSERT_TRUE(writeImage(folder / "bad.exr", sky));
    auto result = loadEnvironment(folder / "bad.exr");
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::Input);
    EXPECT_TRUE(mentions(result.error().message, "pixel (2, 1) is "));
  }
  WriteImageOptions bytes;
  bytes.format = PixelFormat::U8;
  ASSERT_TRUE(writeImage(folder / "low.png", Image(4, 2, 3, 0.5f), bytes));
  auto low = loadEnvironment(folder / "low.png");
  ASSERT_FALSE(low);
  EXPECT_TRUE(mentions(low.error().message, "holds integers (png), not radiance"));
  EXPECT_FALSE(loadEnvironment(folder / "gone.hdr"));
}

}  // namespace
}  // namespace lumel
