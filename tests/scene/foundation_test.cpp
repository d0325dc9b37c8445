#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "scene/base/expected.h"
#include "scene/base/math.h"
#include "scene/base/parallel.h"
#include "scene/images/image_io.h"
#include "tests/mentions.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

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
  const fs::path file = scratch() / "a.exr";
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
  const fs::path whole = scratch() / "whole.png", parts = scratch() / "parts.png";
  const WriteImageOptions options{.format = PixelFormat::U16, .channelNames = {}, .metadata = {}};
  ASSERT_TRUE(writeImage(whole, image, options));
  const auto rows = [&](int first, int count) {
    Image part(5, count, 3);
    std::copy_n(image.at(0, first), part.pixels.size(), part.pixels.begin());
    return part;
  };
  {
    FileSet set;
    auto writer = ImageWriter::open(*set.add(parts), 5, 7, 3, options);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->write(rows(0, 3)));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(parts.parent_path()), {}), 1) << "only the whole file";
  FileSet set;
  auto writer = ImageWriter::open(*set.add(parts), 5, 7, 3, options);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(rows(0, 3)));
  ASSERT_TRUE(writer->write(rows(3, 4)));
  ASSERT_TRUE(writer->finish());
  EXPECT_FALSE(fs::exists(parts));
  ASSERT_TRUE(set.commit());
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

/// A texture of a type that the loaders let through must also be decodable: the type is told by the bytes alone.
TEST(ImageIo, GifInMemoryIsRead) {
  // One white pixel: header, a palette of two, an image of one LZW block.
  const std::vector<std::uint8_t> gif = {'G', 'I', 'F', '8', '9', 'a', 1, 0, 1, 0, 0x80, 0, 0, 0xFF, 0xFF, 0xFF, 0,  0,
                                         0,   ',', 0,   0,   0,   0,   1, 0, 1, 0, 0,    2, 2, 0x44, 1,    0,    ';'};
  auto image = readImage(gif, "pixel.gif");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->format, "gif");
  EXPECT_TRUE(image->paletted);
  EXPECT_EQ(image->image.rgb(0, 0), Vec3(1.0f));
}

TEST(ImageIo, HalfOverflowAndNanFailLoudlyAndLeaveNoFile) {
  Image image(2, 1, 3, 1.0f);
  image.pixels[4] = 70000.0f;
  const fs::path file = scratch() / "b.exr";
  WriteImageOptions half;
  half.format = PixelFormat::Half;
  auto result = writeImage(file, image, half);
  ASSERT_FALSE(result);
  EXPECT_TRUE(mentions(result.error().message, "65504"));
  image.pixels[4] = NAN;
  EXPECT_FALSE(writeImage(file, image));
  EXPECT_FALSE(fs::exists(file));
}

TEST(ImageIo, MissingAndUnwritableFilesAreErrors) {
  EXPECT_EQ(readImage("/nonexistent/x.png").error().kind, ErrorKind::Input);
  EXPECT_EQ(writeImage("/nonexistent/x.exr", Image(2, 2, 3)).error().kind, ErrorKind::Failed);
}

// Whole, a file is read; cut anywhere before its last pixels, it is an error of one line that names it: also where the
// decoder would fill in the rest (JPEG, TIFF), and from memory as textures come.
TEST(ImageIo, CutOffFilesOfAnyFormatAreErrors) {
  Image image(64, 64, 3);
  std::uint32_t state = 1;  // noise: every row takes its share of the file
  for (float& v : image.pixels) v = static_cast<float>((state = state * 1664525 + 1013904223) >> 24) / 255.0f;
  for (const char* name : {"cut.png", "cut.jpg", "cut.tga", "cut.tif", "cut.exr", "cut.hdr", "cut.bmp", "cut.webp"}) {
    const fs::path file = scratch() / name;
    const bool isFloat = file.extension() == ".exr" || file.extension() == ".hdr";
    ASSERT_TRUE(writeImage(
        file, image, {.format = isFloat ? PixelFormat::Float : PixelFormat::U8, .channelNames = {}, .metadata = {}}))
        << name;
    std::vector<std::uint8_t> bytes;
    {
      std::ifstream in(file, std::ios::binary);
      bytes.assign(std::istreambuf_iterator<char>(in), {});
    }
    ASSERT_TRUE(readImage(file)) << name;
    ASSERT_TRUE(readImage(bytes, "memory")) << name;
    // What follows the pixels may be missing in a TGA (a footer of 26 bytes and more) and a TIFF (its directory).
    for (const std::size_t length : {std::size_t{20}, bytes.size() / 10, bytes.size() / 2, bytes.size() * 9 / 10}) {
      fs::resize_file(file, length);
      for (const auto& cut : {readImage(file), readImage(std::span(bytes).first(length), "memory")}) {
        ASSERT_FALSE(cut) << name << " cut to " << length << " of " << bytes.size();
        EXPECT_EQ(cut.error().kind, ErrorKind::Input);
        EXPECT_FALSE(mentions(cut.error().message, "\n"));
      }
      EXPECT_TRUE(mentions(readImage(file).error().message, file.string()));
      std::ofstream(file, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
  }
}

}  // namespace
}  // namespace lumel
