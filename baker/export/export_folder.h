// The folder of an export: files that appear together, and export.json, which lists them and says what they hold.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/expected.h"
#include "scene/files/file_set.h"
#include "scene/image.h"
#include "scene/images/image_io.h"

namespace lumel {

/// The file that marks a folder as an export.
inline constexpr const char* kExportJson = "export.json";

class ExportFolder {
 public:
  /// Errors: Usage, where the folder holds a bake; Failed, where it cannot be written.
  static Expected<ExportFolder> open(const std::filesystem::path& dir);

  Expected<void> add(const std::string& name, std::string_view text);
  Expected<void> add(const std::string& name, std::span<const std::uint8_t> bytes);
  Expected<void> add(const std::string& name, const Image& image, const WriteImageOptions& options);

  /// Adds export.json with `description` and the names of all files, and puts everything in place. Files that an
  /// earlier export.json of the folder lists, and this one does not have, are removed. Errors: Failed.
  Expected<void> commit(nlohmann::ordered_json description);

  /// Files so far; export.json counts once it is there.
  std::size_t fileCount() const { return names_.size(); }

 private:
  Expected<PendingFile> place(const std::string& name);

  std::filesystem::path dir_;
  FileSet set_;
  std::vector<std::string> names_;
};

}  // namespace lumel
