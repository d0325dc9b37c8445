// Results of several files, made whole in a hidden folder before any of them is seen.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/expected.h"

namespace lumel {

/// The folder in which a result is made whole. Removed with all it holds unless committed.
class Staging {
 public:
  /// Makes `dir` if needed, and in it the folder for the files. Errors: Failed.
  static Expected<Staging> make(const std::filesystem::path& dir);
  Staging(Staging&& other) noexcept { swap(other); }
  Staging& operator=(Staging&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Staging();

  /// What processes that were killed left behind in `dir`: what they had not written is removed, and an old result that
  /// one was about to replace is put back. Also part of make.
  static void recover(const std::filesystem::path& dir);

  /// Where to write a file of the result.
  std::filesystem::path file(const std::string& name) {
    names_.push_back(name);
    return path_ / name;
  }

  /// Puts the new files in the place of an older result's: those of the same names, and others that `ours` knows. They
  /// stay in the staging folder until all is in place: if a step fails, all is put back. The file named last tells
  /// readers that a result is there: it leaves first and comes last, so none takes a mixture for a result. Killed in
  /// between, the folder has no such file until recover. Errors: Failed.
  Expected<void> commit(const std::function<bool(const std::string& name)>& ours);

 private:
  Staging() = default;
  Expected<void> exchange(const std::function<bool(const std::string& name)>& ours, std::vector<std::string>& arrived);
  void swap(Staging& other) {
    std::swap(dir_, other.dir_);
    std::swap(path_, other.path_);
    std::swap(names_, other.names_);
  }

  std::filesystem::path dir_;
  std::filesystem::path path_;
  std::vector<std::string> names_;
};

/// Errors: Failed.
Expected<void> writeBytes(const std::filesystem::path& file, std::string_view bytes);
/// The pieces one after the other.
Expected<void> writeBytes(const std::filesystem::path& file, std::span<const std::vector<std::uint8_t>> pieces);

/// Finds out before the long work whether `dir` can be written: makes it and a file in it, and removes what it made.
/// Errors: Failed, naming the folder.
Expected<void> checkWritable(const std::filesystem::path& dir);

}  // namespace lumel
