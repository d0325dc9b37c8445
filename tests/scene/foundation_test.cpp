#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "scene/expected.h"
#include "scene/image_io.h"
#include "scene/math.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  const fs::path dir = fs::path(testing::TempDir()) / (std::string("lumel-") + info->name());
  fs::create_directories(dir);
  return dir / name;
}

TEST(ParallelFor, CoversEveryItemOnceInBlocksOfTheGrain) {
  for (int threads : {1, 2}) {
    ThreadLimit limit(threads);
    std::vector<std::atomic<int>> hits(1003);
    parallelFor(hits.size(), 16, [&](std::size_t first, std::size_t last) {
      EXPECT_EQ(first % 16, 0u);
      for (std::size_t i = first; i < last; ++i) ++hits[i];
    });
    for (auto& h : hits) EXPECT_EQ(h.load(), 1);
  }
}

TEST(Frame, FromTangentIsOrthonormalAndKeepsHandedness) {
  const Vec3 n = glm::normalize(Vec3(0.2f, 0.9f, -0.3f));
  for (float w : {1.0f, -1.0f}) {
    const Frame f = frameFromTangent(n, Vec4(1, 0.5f, 0, w));
    EXPECT_NEAR(glm::dot(f.t, f.n), 0, 1e-6);
    EXPECT_NEAR(glm::dot(f.b, f.n), 0, 1e-6);
    EXPECT_NEAR(glm::length(f.t), 1, 1e-6);
    EXPECT_NEAR(glm::dot(glm::cross(f.n, f.t), f.b), w, 1e-6);
  }
}

TEST(Frame, DegenerateTangentsFallBackToAFrameAboutTheNormal) {
  const Vec3 n(0, 1, 0);
  for (Vec4 bad : {Vec4(0, 0, 0, 1), Vec4(0, 2, 0, 1), Vec4(NAN, 0, 0, 1)}) {
    const Frame f = frameFromTangent(n, bad);
    EXPECT_NEAR(glm::length(f.t), 1, 1e-6);
    EXPECT_NEAR(glm::dot(f.t, n), 0, 1e-6);
  }
}

TEST(ImageIo, ExrRoundTripKeepsFloatsAndMetadata) {
  Image image(3, 2, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) * 1e5f + 0.125f;
  const fs::path file = scratch("a.exr");
  WriteImageOptions options;
  options.metadata["lumel:decode"] = "squared";
  ASSERT_TRUE(writeImage(file, image, options));
  auto back = readImage(file);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->image.pixels, image.pixels);
  EXPECT_EQ(back->metadata["lumel:decode"], "squared");
  EXPECT_TRUE(back->isFloat);
}

TEST(ImageIo, PngInMemoryRoundTrips) {
  Image image(5, 4, 4);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) / 255.0f;
  auto png = encodePng(image);
  ASSERT_TRUE(png);
  auto back = readImage(*png, "memory");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->bitsPerChannel, 8);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) EXPECT_NEAR(back->image.pixels[i], image.pixels[i], 1e-6);
}

TEST(ImageIo, PartsMakeTheSameFileAndAnUnfinishedOneLeavesNothing) {
  Image image(5, 7, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) / 128;
  fs::remove_all(scratch("").parent_path());  // what an earlier run has left
  const fs::path whole = scratch("whole.png"), parts = scratch("parts.png");
  ASSERT_TRUE(writeImage(whole, image, {.format = PixelFormat::U16, .channelNames = {}, .metadata = {}}));
  const auto rows = [&](int first, int count) {
    Image part(5, count, 3);
    std::copy_n(image.at(0, first), part.pixels.size(), part.pixels.begin());
    return part;
  };
  {
    auto writer = ImageWriter::open(parts, 5, 7, 3, {.format = PixelFormat::U16, .channelNames = {}, .metadata = {}});
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->write(rows(0, 3)));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(parts.parent_path()), {}), 1) << "only the whole file";
  auto writer = ImageWriter::open(parts, 5, 7, 3, {.format = PixelFormat::U16, .channelNames = {}, .metadata = {}});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(rows(0, 3)));
  ASSERT_TRUE(writer->write(rows(3, 4)));
  EXPECT_FALSE(fs::exists(parts));
  ASSERT_TRUE(writer->commit());
  EXPECT_EQ(readImage(parts)->image.pixels, readImage(whole)->image.pixels);
}

TEST(ImageIo, IndexedColoursAreNamed) {
  // A 1x1 TGA of image type 1: one table entry (blue 30, green 20, red 10) and the index 0.
  const std::vector<std::uint8_t> tga{0, 1, 1, 0, 0, 1, 0, 24, 0, 0, 0, 0, 1, 0, 1, 0, 8, 0, 30, 20, 10, 0};
  auto indexed = readImage(tga, "indexed.tga");
  ASSERT_TRUE(indexed) << indexed.error().message;
  EXPECT_TRUE(indexed->paletted);
  auto png = encodePng(Image(2, 2, 3, 0.5f));
  ASSERT_TRUE(png);
  EXPECT_FALSE(readImage(*png, "rgb.png")->paletted);
}

TEST(ImageIo, HalfOverflowAndNanFailLoudlyAndLeaveNoFile) {
  Image image(2, 1, 3, 1.0f);
  image.pixels[4] = 70000.0f;
  const fs::path file = scratch("b.exr");
  WriteImageOptions half;
  half.format = PixelFormat::Half;
  auto result = writeImage(file, image, half);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("65504"), std::string::npos);
  image.pixels[4] = NAN;
  EXPECT_FALSE(writeImage(file, image));
  EXPECT_FALSE(fs::exists(file));
}

TEST(ImageIo, MissingTruncatedAndUnwritableFilesAreErrors) {
  EXPECT_EQ(readImage("/nonexistent/x.png").error().kind, ErrorKind::Input);
  Image image(64, 64, 3, 0.5f);
  auto png = encodePng(image);
  ASSERT_TRUE(png);
  auto cut = readImage(std::span(*png).first(png->size() / 2), "cut");
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().kind, ErrorKind::Input);
  EXPECT_EQ(writeImage("/nonexistent/x.exr", image).error().kind, ErrorKind::Failed);
}

}  // namespace
}  // namespace lumel
