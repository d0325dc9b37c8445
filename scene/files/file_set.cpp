#include "scene/files/file_set.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = ".lumel-";
constexpr const char* kSuffix = ".part";
// Folders in the hidden one for files that are replaced; the second for the one that marks a folder as a result.
constexpr const char* kOld = "old";
constexpr const char* kOldLast = "old-last";

Expected<void> flush(const PendingFile& file) {
  const int descriptor = open(file.path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = descriptor >= 0 && fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (!flushed) return cannotWrite(file.place, std::strerror(error));
  return {};
}

/// Whether this is the hidden folder of a process that is gone.
bool isAbandoned(const std::string& name) {
  const std::size_t prefix = std::strlen(kPrefix), suffix = std::strlen(kSuffix);
  if (name.size() <= prefix + suffix || !name.starts_with(kPrefix) || !name.ends_with(kSuffix)) return false;
  pid_t pid = 0;
  const char* end = name.data() + name.size() - suffix;
  const auto parsed = std::from_chars(name.data() + prefix, end, pid);
  if (parsed.ec != std::errc() || (parsed.ptr != end && *parsed.ptr != '-') || pid <= 0) return false;
  return kill(pid, 0) != 0 && errno != EPERM;
}

std::vector<fs::path> filesIn(const fs::path& dir) {
  std::error_code ec;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(dir, ec)) files.push_back(entry.path());
  return files;
}

fs::path folderOf(const fs::path& place) { return place.has_parent_path() ? place.parent_path() : fs::path("."); }

}  // namespace

Error cannotWrite(const fs::path& file, const std::string& why) {
  return failure(file.string() + ": cannot be written: " + why);
}

FileSet::~FileSet() {
  std::error_code ec;
  for (const fs::path& folder : folders_) fs::remove_all(folder, ec);
  if (!made_.empty()) fs::remove(made_, ec);  // only if it is empty
}

Expected<FileSet> FileSet::forFolder(const fs::path& dir) {
  std::error_code ec;
  FileSet set;
  if (fs::create_directories(dir, ec)) set.made_ = dir;
  if (ec) return cannotWrite(dir, ec.message());
  recover(dir);
  return set;
}

Expected<PendingFile> FileSet::add(const fs::path& place) {
  std::error_code ec;
  const fs::path dir = folderOf(place);
  for (const PendingFile& other : files_)
    if (other.place.filename() == place.filename() && fs::equivalent(folderOf(other.place), dir, ec))
      return usageError(place.string() + ": is to be written twice; give each file a name of its own");
  if (fs::exists(place, ec) && !fs::is_regular_file(place, ec))
    return cannotWrite(place, "something that is not a file has that name");
  const auto sameFolder = [&](const fs::path& folder) { return folder.parent_path() == dir; };
  auto folder = std::find_if(folders_.begin(), folders_.end(), sameFolder);
  for (int n = 0; folder == folders_.end(); ++n) {
    const fs::path hidden =
        dir / (kPrefix + std::to_string(getpid()) + (n > 0 ? "-" + std::to_string(n) : "") + kSuffix);
    // A folder that is not made without an error has a name that another set of this process took.
    if (fs::create_directory(hidden, ec)) folder = folders_.insert(folder, hidden);
    if (ec) return cannotWrite(place, ec.message());
  }
  files_.push_back({place, *folder / place.filename()});
  return files_.back();
}

void FileSet::recover(const fs::path& dir) {
  for (const fs::path& hidden : filesIn(dir)) {
    if (!isAbandoned(hidden.filename().string())) continue;
    std::error_code ec;
    for (const fs::path& last : filesIn(hidden / kOldLast)) {
      if (fs::exists(dir / last.filename(), ec)) continue;
      for (const char* folder : {kOld, kOldLast})
        for (const fs::path& file : filesIn(hidden / folder)) fs::rename(file, dir / file.filename(), ec);
    }
    fs::remove_all(hidden, ec);
  }
}

Expected<void> FileSet::commit(bool lastIsMark, const std::function<bool(const std::string& name)>& ours) {
  for (const PendingFile& file : files_)
    if (auto flushed = flush(file); !flushed) return flushed;
  std::vector<Step> done;
  auto exchanged = exchange(lastIsMark, ours, done);
  std::error_code ec;
  for (auto step = done.rbegin(); !exchanged && step != done.rend(); ++step) {
    if (step->old.empty())
      fs::remove(step->place, ec);
    else
      fs::rename(step->old, step->place, ec);
  }
  *this = FileSet();
  return exchanged;
}

Expected<void> FileSet::exchange(bool lastIsMark, const std::function<bool(const std::string& name)>& ours,
                                 std::vector<Step>& done) const {
  if (files_.empty()) return {};
  std::error_code ec;
  const auto setAside = [&](const fs::path& place, const fs::path& folder, bool stays) -> Expected<void> {
    const fs::path old = folder / place.filename();
    fs::create_directory(folder, ec);
    // A second name for it; where links are not to be had, its only one for a moment.
    if (stays) fs::create_hard_link(place, old, ec);
    if (!stays || ec) fs::rename(place, old, ec);
    if (ec) return cannotWrite(place, ec.message());
    done.push_back({place, old});
    return {};
  };
  const PendingFile& last = files_.back();
  const fs::path hidden = last.path.parent_path(), dir = folderOf(last.place);
  if (lastIsMark && fs::is_regular_file(last.place, ec))
    if (auto moved = setAside(last.place, hidden / kOldLast, false); !moved) return moved;
  if (ours)
    for (const fs::path& file : filesIn(dir)) {
      const auto isNew = [&](const PendingFile& f) { return f.place.filename() == file.filename(); };
      if (!ours(file.filename().string()) || !fs::is_regular_file(file, ec) ||
          std::any_of(files_.begin(), files_.end(), isNew))
        continue;
      if (auto moved = setAside(file, hidden / kOld, false); !moved) return moved;
    }
  for (const PendingFile& file : files_) {
    const fs::file_status there = fs::symlink_status(file.place, ec);
    if (fs::is_directory(there)) return cannotWrite(file.place, "a folder has that name");
    const bool stood = fs::exists(there);
    if (stood)
      if (auto kept = setAside(file.place, file.path.parent_path() / kOld, true); !kept) return kept;
    fs::rename(file.path, file.place, ec);
    if (ec) return cannotWrite(file.place, ec.message());
    if (!stood) done.push_back({file.place, {}});
  }
  return {};
}

Expected<void> writeBytes(const PendingFile& file, std::string_view bytes) {
  const std::vector<std::uint8_t> piece(bytes.begin(), bytes.end());
  return writeBytes(file, {&piece, 1});
}

Expected<void> writeBytes(const PendingFile& file, std::span<const std::vector<std::uint8_t>> pieces) {
  std::FILE* out = std::fopen(file.path.c_str(), "wb");
  bool written = out != nullptr;
  for (const std::vector<std::uint8_t>& piece : pieces)
    written = written && std::fwrite(piece.data(), 1, piece.size(), out) == piece.size();
  written = written && std::fflush(out) == 0;
  const int error = errno;
  if (out) std::fclose(out);
  if (!written) return cannotWrite(file.place, std::strerror(error));
  return {};
}

Expected<void> checkNoInput(const fs::path& place, std::span<const fs::path> inputs) {
  std::error_code ec;
  for (const fs::path& input : inputs)
    if (!place.empty() && !input.empty() && fs::equivalent(place, input, ec))
      return usageError(place.string() + ": is read as an input and would be lost; choose another output");
  return {};
}

Expected<void> checkWritable(const fs::path& dir) {
  fs::path made;  // the first folder on the way that is not there yet
  std::error_code ec;
  for (fs::path p = fs::absolute(dir, ec).lexically_normal(); !p.empty() && !fs::exists(p, ec) && p != p.parent_path();
       p = p.parent_path())
    made = p;
  fs::create_directories(dir, ec);
  if (ec || !fs::is_directory(dir)) return cannotWrite(dir, ec ? ec.message() : "not a folder");
  auto probed = FileSet().add(dir / ".lumel-probe");
  if (!made.empty()) fs::remove_all(made, ec);
  if (!probed) return cannotWrite(dir, "no file can be made in it");
  return {};
}

}  // namespace lumel
