// Output files: written in full where no reader looks, then put in place together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/expected.h"

namespace lumel {

struct PendingFile {
  std::filesystem::path place;  // where it will be
  std::filesystem::path path;   // where it is written until then
};

/// Files that appear together or not at all. Until commit they are in a hidden folder beside their places
/// (".lumel-PROCESS.part"), which the destructor removes; an older result stays whole and visible.
class FileSet {
 public:
  FileSet() = default;
  FileSet(FileSet&& other) noexcept { swap(other); }
  FileSet& operator=(FileSet&& other) noexcept {
    swap(other);
    return *this;
  }
  ~FileSet();

  /// Returns a set for a result that owns the folder `dir`: makes the folder if needed (the destructor removes it again
  /// if it is empty) and calls recover. Errors: Failed.
  static Expected<FileSet> forFolder(const std::filesystem::path& dir);

  /// One more file, to be written to the returned `path`. The folder of `place` must exist. Errors: Usage (the set has
  /// that file already), Failed (no file can be made there, or what has that name is not a file).
  Expected<PendingFile> add(const std::filesystem::path& place);

  /// Flushes every file to the disk, then moves each to its place, replacing what is there. If a step fails, all are
  /// put back. A reader never sees part of a file, but between two moves it may see some files new and others old; so
  /// it is left if the process is killed then. Errors: Failed, naming the file.
  Expected<void> commit() { return commit(false, {}); }

  /// The same for a result that owns a folder. The file added last marks the folder as a result for readers: the old
  /// one is moved away first and the new one comes last, so that nobody reads a mixture. Files of an older result that
  /// the set lacks (those whose names `ours` accepts) are removed. If the process is killed in between, the folder has
  /// no such mark until recover.
  Expected<void> commitFolder(const std::function<bool(const std::string& name)>& ours) { return commit(true, ours); }

  /// Cleans up after processes that were killed: removes what they had not put in place in `dir`, and puts back an old
  /// result that commitFolder was about to replace.
  static void recover(const std::filesystem::path& dir);

 private:
  struct Step {
    std::filesystem::path place, old;  // old: where the replaced file is now; empty if there was none
  };
  Expected<void> commit(bool lastIsMark, const std::function<bool(const std::string& name)>& ours);
  Expected<void> exchange(bool lastIsMark, const std::function<bool(const std::string& name)>& ours,
                          std::vector<Step>& done) const;
  void swap(FileSet& other) {
    std::swap(files_, other.files_);
    std::swap(folders_, other.folders_);
    std::swap(made_, other.made_);
  }

  std::vector<PendingFile> files_;
  std::vector<std::filesystem::path> folders_;  // the hidden ones
  std::filesystem::path made_;                  // by forFolder
};

/// Errors: Failed, naming the place.
Expected<void> writeBytes(const PendingFile& file, std::string_view bytes);
/// The pieces one after the other.
Expected<void> writeBytes(const PendingFile& file, std::span<const std::vector<std::uint8_t>> pieces);

/// Refuses an output that would overwrite one of its own inputs. Empty paths are ignored. Errors: Usage, naming the
/// file.
Expected<void> checkNoInput(const std::filesystem::path& place, std::span<const std::filesystem::path> inputs);

/// Finds out before the long work whether `dir` can be written: makes it and a file in it, and removes what it made.
/// Errors: Failed, naming the folder.
Expected<void> checkWritable(const std::filesystem::path& dir);

/// "FILE: cannot be written: WHY".
Error cannotWrite(const std::filesystem::path& file, const std::string& why);

}  // namespace lumel
