// Results of one file or more: made whole where no reader looks, then put in place together.
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

/// A file on its way: where it is to stand, and where it is written before.
struct PendingFile {
  std::filesystem::path place, path;
};

/// Files that appear together or not at all. Until then they stand in a hidden folder beside their places
/// (".lumel-PROCESS.part"), which goes with the object; an older result stays whole and visible.
class FileSet {
 public:
  FileSet() = default;
  FileSet(FileSet&& other) noexcept { swap(other); }
  FileSet& operator=(FileSet&& other) noexcept {
    swap(other);
    return *this;
  }
  ~FileSet();

  /// For a result that owns the folder `dir`: makes the folder if needed (and removes it again if the
  /// result does not come), and recovers. Errors: Failed.
  static Expected<FileSet> forFolder(const std::filesystem::path& dir);

  /// One more file, to be written under `path`. The folder of its place must be there. Errors: Usage (the set has it
  /// already), Failed (no file can be made there, or something else than a file has that name).
  Expected<PendingFile> add(const std::filesystem::path& place);

  /// Flushes every file to the disk, then moves each to its place, over what stands there. If a step fails, all is put
  /// back. A reader never sees part of a file, but may come between two moves; killed there, some files are new and
  /// some old, each whole. Errors: Failed, naming the file.
  Expected<void> commit() { return commit(false, {}); }

  /// The same for a result that owns a folder. The file added last tells readers that a result is there: it leaves
  /// first and comes last, so that none takes a mixture for a result. Files of an older result that the set does not
  /// have, those whose names `ours` knows, go away with it. Killed in between, the folder has no such file until
  /// recover.
  Expected<void> commitFolder(const std::function<bool(const std::string& name)>& ours) { return commit(true, ours); }

  /// What processes that were killed left behind in `dir`: what they had not put in place is removed, and an old result
  /// that commitFolder was about to replace is put back.
  static void recover(const std::filesystem::path& dir);

 private:
  struct Step {
    std::filesystem::path place, old;  // old: where the file went that stood there; empty where none did
  };
  Expected<void> commit(bool tellsLast, const std::function<bool(const std::string& name)>& ours);
  Expected<void> exchange(bool tellsLast, const std::function<bool(const std::string& name)>& ours,
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

/// Refuses a result that would take the place of a file that it is made from. Empty paths are passed over.
/// Errors: Usage, naming the file.
Expected<void> checkNoInput(const std::filesystem::path& place, std::span<const std::filesystem::path> inputs);

/// Finds out before the long work whether `dir` can be written: makes it and a file in it, and removes what it made.
/// Errors: Failed, naming the folder.
Expected<void> checkWritable(const std::filesystem::path& dir);

/// "FILE: cannot be written: WHY".
Error cannotWrite(const std::filesystem::path& file, const std::string& why);

}  // namespace lumel
