// Files that are complete before anybody sees them, alone or as a set.
#pragma once

#include <filesystem>
#include <span>

#include "scene/expected.h"

namespace lumel {

/// The place of a file to be, and a temporary name beside it (with the same extension) to write it under. What stands
/// under the temporary name is removed with the object, unless it has been put in place.
class PendingFile {
 public:
  explicit PendingFile(std::filesystem::path file);
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&& other) noexcept;
  ~PendingFile();

  const std::filesystem::path& file() const { return file_; }
  const std::filesystem::path& temporary() const { return temporary_; }

 private:
  friend Expected<void> putInPlace(std::span<PendingFile> files);
  std::filesystem::path file_, temporary_;  // temporary_ is empty once in place or moved from
};

/// Renames every file of a set to its place, over what is there. If one cannot be, those before it are taken back: the
/// places hold what they held. A reader never sees part of a file, but may come between two renames; a crash there
/// leaves some files new and some old, each whole. Errors: Failed, naming the file.
Expected<void> putInPlace(std::span<PendingFile> files);

}  // namespace lumel
