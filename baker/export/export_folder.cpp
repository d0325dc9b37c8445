#include "baker/export/export_folder.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "baker/files/names/version.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The files that the export in a folder lists; none without one.
std::set<std::string> listedFiles(const fs::path& dir) {
  std::ifstream in(dir / kExportJson, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const Json json = Json::parse(text, nullptr, false);
  std::set<std::string> names;
  if (json.is_object() && json.value("files", Json()).is_array())
    for (const Json& name : json.at("files"))
      if (name.is_string()) names.insert(name.get<std::string>());
  return names;
}

}  // namespace

Expected<ExportFolder> ExportFolder::open(const fs::path& dir) {
  if (fs::exists(dir / "bake.json"))
    return usageError(dir.string() + ": holds a bake, whose files an export would replace; use another folder");
  auto set = FileSet::forFolder(dir);
  if (!set) return set.error();
  ExportFolder folder;
  folder.dir_ = dir;
  folder.set_ = std::move(*set);
  return folder;
}

Expected<PendingFile> ExportFolder::place(const std::string& name) {
  names_.push_back(name);
  return set_.add(dir_ / name);
}

Expected<void> ExportFolder::add(const std::string& name, std::string_view text) {
  const auto file = place(name);
  if (!file) return file.error();
  return writeBytes(*file, text);
}

Expected<void> ExportFolder::add(const std::string& name, std::span<const std::uint8_t> bytes) {
  return add(name, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

Expected<void> ExportFolder::add(const std::string& name, const Image& image, const WriteImageOptions& options) {
  const auto file = place(name);
  if (!file) return file.error();
  return writeImage(*file, image, options);
}

Expected<void> ExportFolder::commit(Json description) {
  Json json = {{"format", 1}, {"lumel", kVersion}};
  json.update(description);
  json["files"] = names_;
  const std::set<std::string> older = listedFiles(dir_);
  // Names come from files and need not be valid UTF-8.
  if (auto done = add(kExportJson, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"); !done) return done;
  return set_.commitFolder([&older](const std::string& name) { return older.count(name) > 0 || name == kExportJson; });
}

}  // namespace lumel
