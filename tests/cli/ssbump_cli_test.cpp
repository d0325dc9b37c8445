// `lumel ssbump` as a user runs it: exit codes, messages, files. LUMEL_BINARY is the built program.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "baker/commands/command_line.h"
#include "scene/images/image_io.h"
#include "tests/cli/harness.h"
#include "tests/mentions.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

namespace fs = std::filesystem;

struct Ran {
  int code = -1;
  std::string output;  // standard output and error
};

class SsbumpCli : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = scratch();
    const HeightField field = fields::fractal(64, 64, 1, 4);
    Image grey(64, 64, 1);
    grey.pixels = field.texels;
    ASSERT_TRUE(writeImage(folder_ / "h.png", grey, {.format = PixelFormat::U16, .channelNames = {}, .metadata = {}}));
  }

  /// Arguments as on a command line, run in the test's folder.
  static std::vector<std::string> words(const std::string& arguments) {
    std::istringstream stream("ssbump " + arguments);
    return {std::istream_iterator<std::string>(stream), {}};
  }
  Ran lumel(const std::string& arguments) const {
    const cli::Outcome outcome = cli::run(words(arguments), {.folder = folder_});
    return {outcome.exitCode, outcome.out + outcome.err};
  }
  /// A square of 4 m with a fence across it.
  void writeTile() const {
    std::ofstream(folder_ / "tile.obj")
        << "v 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 2 0 0\nv 2 1 0\nv 2 1 4\nv 2 0 4\nf 1 4 3 2\nf 5 6 7 8\n";
  }
  bool exists(const std::string& name) const { return fs::exists(folder_ / name); }
  Image read(const std::string& name) const {
    auto loaded = readImage(folder_ / name);
    EXPECT_TRUE(loaded) << name;
    return loaded ? std::move(loaded->image) : Image();
  }
  std::size_t files() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {})); }

  fs::path folder_;
};

TEST_F(SsbumpCli, WritesEveryMapThatIsAskedFor) {
  const Ran ran = lumel(
      "h.png -o s.png --height-scale 10 --save-weights w.tif --save-occlusion o.tga --save-ao ao.png --save-normal "
      "n.png "
      "--save-recovered r.exr --contact-sheet sheet.png --study study");
  ASSERT_EQ(ran.code, 0) << ran.output;
  for (const char* name :
       {"s.png", "w.tif", "o.tga", "ao.png", "n.png", "r.exr", "sheet.png", "study/study.md", "study/study.png"})
    EXPECT_TRUE(exists(name)) << name;
  EXPECT_TRUE(mentions(ran.output, "64x64"));
}

TEST_F(SsbumpCli, BothMethodsAndAllFormatsAgree) {
  ASSERT_EQ(lumel("h.png -o a.exr --height-scale 8 --bits float -q").code, 0);
  ASSERT_EQ(lumel("h.png -o b.exr --height-scale 8 --bits float -q --method rays --rays 1024 --threads 1").code, 0);
  const Image a = read("a.exr"), b = read("b.exr");
  double squares = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    squares += std::pow(static_cast<double>(a.pixels[i] - b.pixels[i]), 2);
  // A weight of about a third times the 0.005 by which 1024 rays err.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(a.pixels.size())), 0.004);
  ASSERT_EQ(lumel("h.png -o c.png --height-scale 8 --bits 16 -q").code, 0);
  const Image c = read("c.png");
  for (std::size_t i = 0; i < a.pixels.size(); ++i) ASSERT_NEAR(c.pixels[i], a.pixels[i], 1.0 / 65535);
}

TEST_F(SsbumpCli, ConvertsThereAndBack) {
  ASSERT_EQ(lumel("h.png -o s.exr --height-scale 8 --bits float -q").code, 0);
  ASSERT_EQ(lumel("s.exr --convert --to linear --hand left -o l.exr --bits float -q").code, 0);
  ASSERT_EQ(lumel("l.exr --convert --to squared -o b.exr --bits float -q").code, 0);
  const Image a = read("s.exr"), b = read("b.exr");
  for (std::size_t i = 0; i < a.pixels.size(); ++i) ASSERT_NEAR(a.pixels[i], b.pixels[i], 1e-5);
  ASSERT_EQ(lumel("s.exr --convert --to normal -o n.png -q").code, 0);
  ASSERT_EQ(lumel("n.png --convert --from normal --to mod2x -o m.png -q").code, 0);
  // The second map names its own form: a map faded with itself in another form is itself.
  ASSERT_EQ(lumel("s.exr --cross-fade l.exr --amount 0.5 -o f.exr --bits float -q").code, 0);
  const Image f = read("f.exr");
  for (std::size_t i = 0; i < a.pixels.size(); ++i) ASSERT_NEAR(a.pixels[i], f.pixels[i], 1e-5);
  // So does a detail map: in either form it blends the same.
  ASSERT_EQ(lumel("h.png -o d.exr --height-scale 8 --detail s.exr --detail-repeats 2 --bits float -q").code, 0);
  ASSERT_EQ(lumel("h.png -o e.exr --height-scale 8 --detail b.exr --detail-repeats 2 --bits float -q").code, 0);
  ASSERT_EQ(lumel("h.png -o g.exr --height-scale 8 --detail l.exr --detail-repeats 2 --bits float -q").code, 0);
  const Image d = read("d.exr"), e = read("e.exr"), g = read("g.exr");
  for (std::size_t i = 0; i < d.pixels.size(); ++i) ASSERT_NEAR(d.pixels[i], e.pixels[i], 1e-5);
  for (std::size_t i = 0; i < d.pixels.size(); ++i) ASSERT_NEAR(d.pixels[i], g.pixels[i], 1e-5);
}

// Within this process: starting the program takes longer than refusing a command line.
TEST_F(SsbumpCli, TheCommandLineIsChecked) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  for (const char* wrong :
       {"", "h.png", "h.png -o s.png --method guess", "h.png -o s.png --rays 0", "h.png -o s.png --azimuths -1",
        "h.png -o s.png --height-scale tall", "h.png -o s.png --convention cubed", "h.png -o s.jpeg2 ",
        "h.png -o s.png --bits half", "h.png -o s.png --cone-angle 400", "h.png -o s.png --unknown",
        "h.png -o s.png --low x.obj", "h.png -o s", "h.png -o s.png --save-ao ./s.png",
        // Options that would change nothing.
        "h.png -o s.png --width 64", "h.png -o s.png --rays 10", "h.png -o s.png --method rays --azimuths 8",
        "h.png -o s.png --blocks bc1", "h.png -o s.png --to linear", "h.png -o s.png --cone-angle 60",
        "s.png --convert -o n.png --save-ao ao.png", "s.png --convert --convention linear -o n.png",
        "tile.obj -o s.png --invert", "tile.obj -o s.png --tile-width 2", "tile.obj -o s.png --study study"}) {
    std::ostringstream out;
    const auto done = runCommandLine(words(wrong), out);
    ASSERT_FALSE(done) << wrong;
    EXPECT_EQ(done.error().kind, ErrorKind::Usage) << wrong << "\n" << done.error().message;
    EXPECT_FALSE(done.error().message.empty()) << wrong;
    EXPECT_EQ(files(), 1u) << wrong;
  }
  fs::current_path(before);
  const Ran ran = lumel("h.png -o s.png --method guess");
  EXPECT_EQ(ran.code, 2);
  EXPECT_TRUE(mentions(ran.output, "lumel: "));
  EXPECT_EQ(lumel("--help").code, 0);
}

TEST_F(SsbumpCli, BadInputIsNamedAndLeavesNothing) {
  std::ofstream(folder_ / "empty.png");
  std::ofstream(folder_ / "text.png") << "not an image";
  Image nan(4, 4, 1, 0.5f), one(1, 1, 1, 0.5f);
  nan.pixels[5] = HUGE_VALF;
  ASSERT_TRUE(writeImage(folder_ / "inf.exr", nan, {.format = PixelFormat::Float, .channelNames = {}, .metadata = {}}));
  ASSERT_TRUE(writeImage(folder_ / "one.png", one, {.format = PixelFormat::U8, .channelNames = {}, .metadata = {}}));
  ASSERT_EQ(lumel("h.png -o unused.png --save-normal n.png --height-scale 8 -q").code, 0);
  fs::remove(folder_ / "unused.png");
  const std::size_t before = files();
  for (const char* wrong : {"absent.png", "empty.png", "text.png", "inf.exr", "h.png --channel Z",
                            "h.png --height-scale 1e9", "n.png", "h.png --normal-map h.png", "h.png --mask one.png",
                            "h.png --basis text.png", "h.png --albedo absent.png", "h.png --detail h.png"}) {
    const Ran ran = lumel(std::string(wrong) + " -o s.png -q");
    EXPECT_EQ(ran.code, 3) << wrong << "\n" << ran.output;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << wrong << "\n" << ran.output;
    EXPECT_EQ(files(), before) << wrong;
  }
  EXPECT_EQ(lumel("h.png -o absent/s.png -q").code, 1);
  EXPECT_EQ(files(), before);
  // What has a correct answer gets it: one texel and scale 0 are flat.
  for (const char* flat : {"one.png", "h.png --height-scale 0"}) {
    ASSERT_EQ(lumel(std::string(flat) + " -o flat.exr --bits float -q").code, 0);
    for (float v : read("flat.exr").pixels) ASSERT_NEAR(v, 1.0 / 3, 1e-6);
  }
}

TEST_F(SsbumpCli, StopsWhenAsked) {
  const HeightField field = fields::fractal(2048, 2048, 1, 4);
  Image large(2048, 2048, 1);
  large.pixels = field.texels;
  ASSERT_TRUE(writeImage(folder_ / "l.png", large, {.format = PixelFormat::U16, .channelNames = {}, .metadata = {}}));
  writeTile();
  std::ofstream(folder_ / "s.png") << "an older map";
  const auto before = cli::readFolder(folder_);
  struct Work {
    const char* arguments;
    int signal;
    double cpuSeconds;  // by then it is where it spends its time, which is a quarter of a minute and more
  };
  for (const Work& work : {
           Work{"h.png -o s.png --save-ao ao.png --method rays --rays 1000000", SIGINT, 1},
           Work{"h.png -o s.png --method rays --rays 1000000", SIGTERM, 1},
           Work{"tile.obj -o s.png --rays 1000000", SIGINT, 1},
           Work{"l.png -o s.png --save-normal n.exr --azimuths 1024 --height-scale 1000 --threads 1", SIGINT, 2},
           Work{"l.png -o s.png --bilateral 64 --bilateral-threshold 50 --threads 1", SIGINT, 2},
           Work{"l.png --study study --azimuths 4 --reach 8", SIGINT, 3},
       }) {
    const cli::Outcome stopped =
        cli::runAndInterrupt(words(work.arguments), work.cpuSeconds, work.signal, {.folder = folder_});
    EXPECT_EQ(stopped.exitCode, 130) << work.arguments;
    EXPECT_EQ(stopped.err, "lumel: interrupted\n") << work.arguments;
    EXPECT_LT(stopped.secondsToStop, 6) << work.arguments << ": a tenth of a second on an idle machine";
    EXPECT_TRUE(cli::readFolder(folder_) == before) << work.arguments;
  }
}

TEST_F(SsbumpCli, ProgressOnATerminalOnly) {
  // A second and more of work: the line is drawn every fifth of a second.
  const auto work = words("h.png -o s.png --method rays --rays 4000");
  const auto terminal = cli::runOnTerminal(work, {.folder = folder_});
  if (!terminal) GTEST_SKIP() << "no pseudo-terminal here";
  EXPECT_EQ(terminal->exitCode, 0) << terminal->out;
  EXPECT_TRUE(mentions(terminal->out, "ssbump "));
  EXPECT_TRUE(mentions(terminal->out, "% "));
  EXPECT_TRUE(mentions(terminal->out, " left"));
  const cli::Outcome piped = cli::run(words("h.png -o s.png --method rays --rays 2000 -q"), {.folder = folder_});
  EXPECT_EQ(piped.exitCode, 0);
  EXPECT_EQ(piped.out + piped.err, "");
}

TEST_F(SsbumpCli, MeshesOverAFlatTile) {
  writeTile();
  const Ran ran = lumel("tile.obj -o s.exr --bits float --save-occlusion o.exr --width 16 --height 16 --rays 256 -q");
  ASSERT_EQ(ran.code, 0) << ran.output;
  const Image o = read("o.exr");
  // West of the fence it hides the east (B0), east of it the west.
  EXPECT_LT(o.at(6, 8)[0], o.at(9, 8)[0] - 0.1f);
  EXPECT_EQ(lumel("absent.obj -o t.exr -q").code, 3);
}

}  // namespace
}  // namespace lumel::ssbump
