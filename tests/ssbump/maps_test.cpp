// From files to files: outputs, alpha, mip chains, DDS, conversions, tiles, and errors that leave nothing behind.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "scene/images/image_io.h"
#include "ssbump/bake.h"
#include "ssbump/contact_sheet.h"
#include "ssbump/maps/convert.h"
#include "ssbump/maps/mip.h"
#include "ssbump/study.h"
#include "tests/scratch.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

namespace fs = std::filesystem;

class Maps : public testing::Test {
 protected:
  void SetUp() override { folder_ = scratch(); }
  fs::path path(const std::string& name) const { return folder_ / name; }

  /// A 16-bit height map, with alpha if asked: alpha = x * 257 / 65535 and so on, to be found again bit for bit.
  fs::path heights(int w, int h, bool alpha = false) const {
    const HeightField field = fields::fractal(w, h, 1, 4);
    Image image(w, h, alpha ? 4 : 1);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        for (int c = 0; c < image.channels; ++c)
          image.at(x, y)[c] = c == 3 ? static_cast<float>((x * 7 + y) % 256) / 255.0f : field.at(x, y);
    const fs::path file = path(alpha ? "in_alpha.png" : "in.png");
    EXPECT_TRUE(writeImage(file, image,
                           {.format = alpha ? PixelFormat::U8 : PixelFormat::U16, .channelNames = {}, .metadata = {}}));
    return file;
  }
  BakeSettings settings(const std::string& out) const {
    BakeSettings s;
    s.height.scale = 12;
    s.height.scaleIsPercent = false;
    s.maps.files.ssbump = path(out);
    return s;
  }
  std::size_t filesInFolder() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  fs::path folder_;
  Progress silent_;
};

Image read(const fs::path& file) {
  auto loaded = readImage(file);
  EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
  return loaded ? std::move(loaded->image) : Image();
}

TEST_F(Maps, EveryOutputHoldsWhatItSays) {
  BakeSettings s = settings("s.exr");
  s.maps.options.format = PixelFormat::Float;
  s.maps.files = {path("s.exr"), path("w.exr"), path("o.exr"), path("ao.exr"), path("n.exr"), path("r.exr")};
  auto report = bakeHeightMap(heights(64, 48), s, silent_);
  ASSERT_TRUE(report) << report.error().message;
  const Image ss = read(path("s.exr")), w = read(path("w.exr")), o = read(path("o.exr")), ao = read(path("ao.exr")),
              n = read(path("n.exr")), r = read(path("r.exr"));
  EXPECT_EQ(ao.channels, 1);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_FLOAT_EQ(ss.at(x, y)[c], w.at(x, y)[c] * o.at(x, y)[c]);
      ASSERT_NEAR(w.at(x, y)[0] + w.at(x, y)[1] + w.at(x, y)[2], 1, 1e-5);
      const Vec3 weights = normalWeights(decodeNormal(n.rgb(x, y), Green::Up));
      ASSERT_NEAR(weights.y, w.at(x, y)[1], 1e-5);
      const Vec3 recovered = recoveredNormal(ss.rgb(x, y));
      ASSERT_NEAR(recovered.x, decodeNormal(r.rgb(x, y), Green::Up).x, 1e-5);
      ASSERT_LE(*ao.at(x, y), 1.0f);
    }
  auto meta = readImage(path("s.exr"));
  EXPECT_EQ(meta->metadata["lumel:ssbump"], "squared");
  EXPECT_EQ(meta->metadata["lumel:ssbump:hand"], "right");
}

TEST_F(Maps, ConventionAndHandAreAppliedAndNamedInEveryFormatThatCan) {
  BakeSettings plain = settings("a.exr"), other = settings("b.exr");
  plain.maps.options.format = other.maps.options.format = PixelFormat::Float;
  other.maps.encoding = {Convention::Linear, Hand::Left};
  ASSERT_TRUE(bakeHeightMap(heights(32, 32), plain, silent_));
  ASSERT_TRUE(bakeHeightMap(heights(32, 32), other, silent_));
  auto b = readImage(path("b.exr"));
  const auto form = formFromMetadata(*b);
  ASSERT_TRUE(form && form->encoding);
  EXPECT_EQ(*form->encoding, other.maps.encoding);
  for (const char* name : {"c.png", "c.tif", "c.tga", "c.dds"}) {
    other.maps.files.ssbump = path(name);
    other.maps.options.format.reset();
    ASSERT_TRUE(bakeHeightMap(heights(32, 32), other, silent_)) << name;
    const auto again = formFromMetadata(*readImage(path(name)));
    ASSERT_TRUE(again && again->encoding) << name;
    EXPECT_EQ(*again->encoding, other.maps.encoding) << name;
  }
}

TEST_F(Maps, AlphaAndMaskPassThroughUntouched) {
  BakeSettings s = settings("s.png");
  s.height.channel = "R";
  ASSERT_TRUE(bakeHeightMap(heights(40, 24, true), s, silent_));
  Image out = read(path("s.png"));
  ASSERT_EQ(out.channels, 4);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 40; ++x) ASSERT_EQ(std::lround(out.at(x, y)[3] * 255), (x * 7 + y) % 256);
  Image mask(40, 24, 1);
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) mask.pixels[i] = static_cast<float>(i % 251) / 255.0f;
  ASSERT_TRUE(writeImage(path("mask.png"), mask, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  s.maps.mask = path("mask.png");
  ASSERT_TRUE(bakeHeightMap(heights(40, 24, true), s, silent_));
  out = read(path("s.png"));
  for (std::size_t i = 0; i < mask.pixels.size(); ++i)
    ASSERT_EQ(std::lround(out.pixels[i * 4 + 3] * 255), static_cast<long>(i % 251));
}

TEST_F(Maps, TilesAndThreadsGiveTheSameFile) {
  BakeSettings whole = settings("a.exr"), tiled = settings("b.exr");
  tiled.tileWidth = 50;
  tiled.tileHeight = 14;
  whole.maps.options.format = tiled.maps.options.format = PixelFormat::Float;
  ASSERT_TRUE(bakeHeightMap(heights(150, 70), whole, silent_));
  ASSERT_TRUE(bakeHeightMap(heights(150, 70), tiled, silent_));
  EXPECT_EQ(read(path("a.exr")).pixels, read(path("b.exr")).pixels);
}

TEST_F(Maps, NormalMapsAgainstTheHeightsAreWarnedOf) {
  const fs::path in = heights(64, 64);
  BakeSettings s = settings("s.exr");
  s.maps.files.normal = path("n.png");
  ASSERT_TRUE(bakeHeightMap(in, s, silent_));
  s.maps.files.normal.clear();
  s.normalMap = path("n.png");
  EXPECT_TRUE(bakeHeightMap(in, s, silent_)->warnings.empty());
  s.normalMapGreen = Green::Down;
  const auto flipped = bakeHeightMap(in, s, silent_);
  ASSERT_EQ(flipped->warnings.size(), 1u);
  EXPECT_NE(flipped->warnings[0].find("--green up"), std::string::npos) << flipped->warnings[0];
  s.normalMapGreen = Green::Up;
  s.height.invert = true;
  const auto inverted = bakeHeightMap(in, s, silent_);
  ASSERT_EQ(inverted->warnings.size(), 1u);
  EXPECT_NE(inverted->warnings[0].find("--invert"), std::string::npos) << inverted->warnings[0];
}

TEST_F(Maps, GivenNormalsReplaceDerivedOnes) {
  Image normals(32, 32, 3);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) normals.setRgb(x, y, encodeNormal(glm::normalize(Vec3(0.3f, 0.4f, 1)), Green::Down));
  ASSERT_TRUE(writeImage(path("n.exr"), normals, {.format = PixelFormat::Float, .channelNames = {}, .metadata = {}}));
  BakeSettings s = settings("s.png");
  s.maps.files.weights = path("w.exr");
  s.maps.files.ssbump.clear();
  s.maps.options.format = PixelFormat::Float;
  s.normalMap = path("n.exr");
  s.normalMapGreen = Green::Down;
  ASSERT_TRUE(bakeHeightMap(heights(32, 32), s, silent_));
  const Vec3 expected = normalWeights(glm::normalize(Vec3(0.3f, 0.4f, 1)));
  const Image w = read(path("w.exr"));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(w.at(5, 9)[c], expected[c], 1e-5);
}

TEST_F(Maps, MoreDirectionsMakeMultiChannelExr) {
  std::ofstream(path("basis.txt")) << "0 0 1\n0.6 0 0.8\n-0.6 0 0.8\n0 0.6 0.8\n0 -0.6 0.8\n";
  BakeSettings s = settings("s.exr");
  s.maps.basis = {{0, 0, 1}, {0.6f, 0, 0.8f}, {-0.6f, 0, 0.8f}, {0, 0.6f, 0.8f}, {0, -0.6f, 0.8f}};
  ASSERT_TRUE(bakeHeightMap(heights(32, 32), s, silent_));
  EXPECT_EQ(read(path("s.exr")).channels, 5);
  s.maps.files.ssbump = path("s.png");
  EXPECT_EQ(bakeHeightMap(heights(32, 32), s, silent_).error().kind, ErrorKind::Usage);
}

TEST_F(Maps, MipChainsAreCompleteAndKeepTheMean) {
  for (const auto& [w, h] : {std::pair{64, 32}, {50, 21}}) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    BakeSettings s = settings("s.exr");
    s.maps.options.format = PixelFormat::Float;
    s.maps.options.mips = true;
    ASSERT_TRUE(bakeHeightMap(heights(w, h), s, silent_));
    const auto mean = [](const Image& i) {
      double sum = 0;
      for (float v : i.pixels) sum += static_cast<double>(v);
      return sum / static_cast<double>(i.pixels.size());
    };
    const double top = mean(read(path("s.exr")));
    int width = w, height = h, level = 1;
    for (; width > 1 || height > 1; ++level) {
      width = std::max(1, width / 2), height = std::max(1, height / 2);
      const Image mip = read(path("s.mip" + std::to_string(level) + ".exr"));
      EXPECT_EQ(mip.width, width);
      EXPECT_EQ(mip.height, height);
      EXPECT_NEAR(mean(mip), top, 1e-5);
    }
    EXPECT_FALSE(fs::exists(path("s.mip" + std::to_string(level) + ".exr")));
  }
}

TEST_F(Maps, DdsReadsBack) {
  BakeSettings reference = settings("s.exr"), dds = settings("s.dds");
  reference.maps.options.format = PixelFormat::Float;
  const fs::path in = heights(64, 64);
  ASSERT_TRUE(bakeHeightMap(in, reference, silent_));
  const Image truth = read(path("s.exr"));
  // 8 bits round to half of 1/255. A block's colours lie on one line: the root mean square stays near a tenth of a
  // weight.
  for (const auto& [format, tolerance] : {std::pair{DdsFormat::Rgba8, 0.3 / 255},
                                          {DdsFormat::Rgba16, 1e-5},
                                          {DdsFormat::Rgba16Half, 1.5e-4},  // a unit in the last place at 0.5 is 4.9e-4
                                          {DdsFormat::Bc1, 0.06},
                                          {DdsFormat::Bc3, 0.06}}) {
    dds.maps.options.ddsFormat = format;
    ASSERT_TRUE(bakeHeightMap(in, dds, silent_));
    const bool wide = format == DdsFormat::Rgba16 || format == DdsFormat::Rgba16Half;
    if (wide) {
      EXPECT_EQ(fs::file_size(path("s.dds")), 148u + 8 * 5461);
    }
    const Image back = read(path("s.dds"));
    ASSERT_EQ(back.width, 64);
    double squares = 0;
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x)
        for (int c = 0; c < 3; ++c) squares += std::pow(static_cast<double>(back.at(x, y)[c] - truth.at(x, y)[c]), 2);
    EXPECT_LT(std::sqrt(squares / (3 * 64 * 64)), tolerance) << static_cast<int>(format);
    if (!wide) continue;
    fs::resize_file(path("s.dds"), 148 + 8 * 64 * 64 - 1);
    const auto cut = readImage(path("s.dds"));
    ASSERT_FALSE(cut);
    EXPECT_NE(cut.error().message.find("is cut off"), std::string::npos);
  }
  // The size of a full BC1 chain: 64x64 down to 1x1, 8 bytes per block, and a header of 128.
  dds.maps.options.ddsFormat = DdsFormat::Bc1;
  ASSERT_TRUE(bakeHeightMap(in, dds, silent_));
  EXPECT_EQ(fs::file_size(path("s.dds")), 128 + 8 * (256 + 64 + 16 + 4 + 1 + 1 + 1));
}

TEST_F(Maps, ConvertRoundTripsAndReadsItsOwnMetadata) {
  BakeSettings s = settings("s.exr");
  s.maps.options.format = PixelFormat::Float;
  ASSERT_TRUE(bakeHeightMap(heights(32, 32), s, silent_));
  ConvertSettings there;
  there.to = {Encoding{Convention::Linear, Hand::Left}, Green::Up};
  there.options.format = PixelFormat::Float;
  ASSERT_TRUE(convertMap(path("s.exr"), path("l.exr"), there));
  ConvertSettings back;
  back.to = {Encoding{}, Green::Up};
  back.options.format = PixelFormat::Float;
  ASSERT_TRUE(convertMap(path("l.exr"), path("b.exr"), back));
  const Image a = read(path("s.exr")), b = read(path("b.exr"));
  for (std::size_t i = 0; i < a.pixels.size(); ++i) ASSERT_NEAR(a.pixels[i], b.pixels[i], 2e-6);
  // To a normal map and back to weights: the recovered normal's weights.
  ConvertSettings toNormal;
  toNormal.to = {{}, Green::Down};
  toNormal.options.format = PixelFormat::Float;
  ASSERT_TRUE(convertMap(path("s.exr"), path("n.exr"), toNormal));
  ASSERT_TRUE(convertMap(path("n.exr"), path("w.exr"), back));
  const Image w = read(path("w.exr"));
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) ASSERT_NEAR(w.rgb(x, y).z, normalWeights(recoveredNormal(a.rgb(x, y))).z, 1e-5);
  // A map that does not say what it is.
  Image anonymous(4, 4, 3, 0.3f);
  ASSERT_TRUE(writeImage(path("x.png"), anonymous, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  EXPECT_NE(convertMap(path("x.png"), path("y.png"), back).error().message.find("--from"), std::string::npos);
}

TEST_F(Maps, ErrorsLeaveNothingBehind) {
  const fs::path in = heights(32, 32);
  const std::size_t before = filesInFolder();
  BakeSettings s = settings("missing/s.png");
  EXPECT_EQ(bakeHeightMap(in, s, silent_).error().kind, ErrorKind::Failed);
  s = settings("s.xyz");
  EXPECT_EQ(bakeHeightMap(in, s, silent_).error().kind, ErrorKind::Usage);
  s = settings("s.png");
  s.maps.files.ambient = path("missing/ao.png");  // the second file fails: the first must not appear
  EXPECT_FALSE(bakeHeightMap(in, s, silent_));
  s = settings("s.png");
  s.maps.options.format = PixelFormat::Half;
  EXPECT_EQ(bakeHeightMap(in, s, silent_).error().kind, ErrorKind::Usage);
  s = settings("s.png");
  s.normalMap = in;
  EXPECT_EQ(bakeHeightMap(in, s, silent_).error().kind, ErrorKind::Input);
  EXPECT_EQ(bakeHeightMap(path("absent.png"), settings("s.png"), silent_).error().kind, ErrorKind::Input);
  struct Impatient : Progress {
    bool cancelled() const override { return true; }
  } impatient;
  EXPECT_EQ(bakeHeightMap(in, settings("s.png"), impatient).error().kind, ErrorKind::Interrupted);
  EXPECT_EQ(filesInFolder(), before);
}

TEST_F(Maps, ASetIsReplacedWholeOrNotAtAll) {
  const fs::path in = heights(32, 16);
  const auto bytes = [](const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  std::ofstream(path("ao.png")) << "an older map";
  BakeSettings s = settings("out.tga");
  s.maps.files.ambient = path("ao.png");
  s.maps.files.normal = path("n.dds");
  s.maps.options.mips = true;
  // The last file to be put in place cannot be: a folder stands there.
  fs::create_directory(path("out.tga"));
  const auto blocked = bakeHeightMap(in, s, silent_);
  ASSERT_FALSE(blocked);
  EXPECT_NE(blocked.error().message.find("out.tga"), std::string::npos) << blocked.error().message;
  EXPECT_EQ(bytes(path("ao.png")), "an older map");
  EXPECT_EQ(filesInFolder(), 3u);  // the input, the older map, the folder
  fs::remove(path("out.tga"));
  ASSERT_TRUE(bakeHeightMap(in, s, silent_));
  EXPECT_NE(bytes(path("ao.png")), "an older map");
  EXPECT_EQ(filesInFolder(), 4u + 2 * 5u);  // the input, three maps, five more levels of two of them
}

TEST_F(Maps, EmptyAndOneTexelFiles) {
  std::ofstream(path("empty.png"));
  EXPECT_EQ(bakeHeightMap(path("empty.png"), settings("s.png"), silent_).error().kind, ErrorKind::Input);
  Image one(1, 1, 1, 0.7f);
  ASSERT_TRUE(writeImage(path("one.png"), one, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  BakeSettings s = settings("s.exr");
  s.maps.options.format = PixelFormat::Float;
  for (BackEnd backEnd : {BackEnd::Horizon, BackEnd::Rays}) {
    s.backEnd = backEnd;
    ASSERT_TRUE(bakeHeightMap(path("one.png"), s, silent_));
    for (float v : read(path("s.exr")).pixels) EXPECT_NEAR(v, 1.0 / 3, 1e-6);
  }
}

TEST_F(Maps, Mod2xCutsAreCounted) {
  BakeSettings s = settings("s.png");
  s.height.scale = 200;
  s.maps.files.weights = path("w.png");
  s.maps.encoding.convention = Convention::Mod2x;
  auto report = bakeHeightMap(heights(64, 64), s, silent_);
  ASSERT_TRUE(report);
  ASSERT_FALSE(report->warnings.empty());
  EXPECT_NE(report->warnings[0].find("were cut"), std::string::npos);
}

TEST(Mip, BoxIsTheExactMeanOfOddSizesAndKaiserKeepsConstants) {
  Image odd(5, 3, 1);
  for (std::size_t i = 0; i < odd.pixels.size(); ++i) odd.pixels[i] = static_cast<float>(i);
  const Image half = halve(odd, MipFilter::Box, true);
  ASSERT_EQ(half.width, 2);
  ASSERT_EQ(half.height, 1);
  // Column means are 5..9; the left half covers columns 0, 1 and half of 2.
  EXPECT_NEAR(half.pixels[0], (5 + 6 + 3.5) / 2.5, 1e-5);
  EXPECT_NEAR(half.pixels[1], (3.5 + 8 + 9) / 2.5, 1e-5);
  for (float v : halve(Image(17, 9, 2, 0.25f), MipFilter::Kaiser, false).pixels) EXPECT_NEAR(v, 0.25, 1e-6);
  EXPECT_TRUE(mipLevels(Image(1, 1, 1), MipFilter::Box, true).empty());
  EXPECT_EQ(mipLevels(Image(300, 7, 1), MipFilter::Box, true).size(), 8u);  // 150, 75, 37, ..., 1 wide
}

Image studyMap() {
  const HeightField field = fields::fractal(64, 64, 8, 4);
  const Image o = Horizon(field, {}).occlusion({0, 0, 64, 64}, rnmLobes());
  Image map(64, 64, 3);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) map.setRgb(x, y, normalWeights(heightNormal(field, x, y)) * o.rgb(x, y));
  return map;
}

TEST(Study, ErrorsFallWithBitsAndLightingOfMipsIsExact) {
  const std::vector<StudyRow> rows = studyFormats(studyMap(), 1);
  const auto find = [&](const std::string& name) {
    for (const StudyRow& r : rows)
      if (r.format == name && r.mip == 0) return r;
    ADD_FAILURE() << name;
    return StudyRow{};
  };
  // Uniform rounding to 8 bits: rmse 1 / (255 sqrt 12).
  EXPECT_NEAR(find("RGB8").weightRmse, 1 / (255 * std::sqrt(12.0)), 1e-4);
  EXPECT_LT(find("RGB8").weightRmse, find("RGB565").weightRmse);
  EXPECT_LT(find("BC5 + BC4").weightRmse, find("BC3 split").weightRmse);
  EXPECT_LT(find("BC3 split").weightRmse, find("BC1").weightRmse);
  EXPECT_LT(find("BC1").normalMeanDegrees, 5);
  // Lighting is linear in the weights: a box-filtered map lit is the lit map box-filtered, to float rounding.
  for (const MipRow& r : studyMips(studyMap(), 4)) EXPECT_LT(r.lightRmse, 1e-6);
}

TEST_F(Maps, StudyAndContactSheetAreWritten) {
  ASSERT_TRUE(writeStudy(studyMap(), "fractal", path("study")));
  EXPECT_TRUE(fs::exists(path("study") / "study.md"));
  EXPECT_EQ(read(path("study") / "study.png").channels, 3);
  ASSERT_TRUE(writeContactSheet(heights(64, 64), settings("unused.png"), 64, path("sheet.png"), silent_));
  EXPECT_EQ(read(path("sheet.png")).width, 4 * 70 + 6);
}

}  // namespace
}  // namespace lumel::ssbump
