// A folder for the files of a test.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

namespace lumel {

/// The running test's own folder: empty at the first call, removed with the process. Processes share none.
inline std::filesystem::path scratch() {
  namespace fs = std::filesystem;
  struct Root {
    fs::path path = fs::path(testing::TempDir()) / ("lumel-test-" + std::to_string(getpid()));
    std::set<fs::path> folders{};
    ~Root() {
      std::error_code ec;
      fs::remove_all(path, ec);
    }
  };
  static Root root;
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  // A parameterised test has slashes in its name.
  const fs::path folder = root.path / test->test_suite_name() / test->name();
  if (root.folders.insert(folder).second) {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  return folder;
}

}  // namespace lumel
