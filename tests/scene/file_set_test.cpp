#include "scene/files/file_set.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <map>

#include "tests/mentions.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

class FileSets : public testing::Test {
 protected:
  void SetUp() override {
    dir_ = scratch();
    fs::create_directories(dir_ / "other");
  }

  void put(const fs::path& name, const std::string& text) const { std::ofstream(dir_ / name) << text; }
  void add(FileSet& set, const fs::path& name, const std::string& text) const {
    const auto file = set.add(dir_ / name);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(writeBytes(*file, text));
  }
  /// Every file, hidden ones too, by its path in the folder.
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(dir_)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path());
      all[entry.path().lexically_relative(dir_)] = std::string(std::istreambuf_iterator<char>(in), {});
    }
    return all;
  }
  using Files = std::map<std::string, std::string>;

  fs::path dir_;
};

TEST_F(FileSets, AppearTogetherInAllTheirFolders) {
  put("a", "old");
  FileSet set;
  add(set, "a", "new");
  add(set, "b", "new");
  add(set, "other/a", "new");
  Files seen = files();
  for (auto it = seen.begin(); it != seen.end();)
    it = it->first.find(".lumel-") != std::string::npos ? seen.erase(it) : std::next(it);
  EXPECT_EQ(seen, (Files{{"a", "old"}}));
  ASSERT_TRUE(set.commit());
  EXPECT_EQ(files(), (Files{{"a", "new"}, {"b", "new"}, {"other/a", "new"}}));
  EXPECT_EQ(std::distance(fs::directory_iterator(dir_), {}), 3) << "no hidden folder";
}

TEST_F(FileSets, WithoutCommitNothingIsLeft) {
  put("a", "old");
  {
    FileSet set;
    add(set, "a", "new");
    FileSet moved = std::move(set);
    add(moved, "b", "new");
  }
  EXPECT_EQ(files(), (Files{{"a", "old"}}));
  { EXPECT_TRUE(FileSet::forFolder(dir_ / "made")); }
  EXPECT_FALSE(fs::exists(dir_ / "made"));
}

TEST_F(FileSets, AStepThatFailsIsUndone) {
  for (const bool folder : {false, true}) {
    for (const char* name : {"a", "b", "last"}) put(name, "old");
    FileSet set;
    for (const char* name : {"a", "new", "c", "last"}) add(set, name, "new");
    fs::create_directories(dir_ / "c" / "inside");  // in the way since
    const auto done = folder ? set.commitFolder([](const std::string& name) { return name == "b"; }) : set.commit();
    ASSERT_FALSE(done);
    EXPECT_TRUE(mentions(done.error().message, (dir_ / "c").string()));
    EXPECT_EQ(files(), (Files{{"a", "old"}, {"b", "old"}, {"last", "old"}}));
    fs::remove_all(dir_ / "c");
  }
}

TEST_F(FileSets, AFolderLosesWhatTheNewResultDoesNotHave) {
  for (const char* name : {"a", "b", "last", "theirs"}) put(name, "old");
  FileSet set;
  for (const char* name : {"a", "last"}) add(set, name, "new");
  ASSERT_TRUE(set.commitFolder([](const std::string& name) { return name.size() == 1; }));
  EXPECT_EQ(files(), (Files{{"a", "new"}, {"last", "new"}, {"theirs", "old"}}));
}

TEST_F(FileSets, TwoSetsMayShareAFolder) {
  FileSet one, two;
  add(one, "a", "one");
  add(two, "b", "two");
  ASSERT_TRUE(one.commit());
  ASSERT_TRUE(two.commit());
  EXPECT_EQ(files(), (Files{{"a", "one"}, {"b", "two"}}));
}

TEST_F(FileSets, BadPlacesAreNamedAtOnce) {
  FileSet set;
  add(set, "a", "new");
  EXPECT_EQ(set.add(dir_ / "other" / ".." / "a").error().kind, ErrorKind::Usage) << "the same file twice";
  EXPECT_EQ(set.add(dir_ / "other").error().kind, ErrorKind::Failed);
  EXPECT_EQ(set.add(dir_ / "missing" / "a").error().kind, ErrorKind::Failed);
  EXPECT_EQ(set.add("/dev/null").error().kind, ErrorKind::Failed);
}

}  // namespace
}  // namespace lumel
