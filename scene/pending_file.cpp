#include "scene/pending_file.h"

#include <unistd.h>

#include <string>
#include <utility>
#include <vector>

namespace lumel {
namespace {

namespace fs = std::filesystem;

fs::path besides(const fs::path& file, const char* what) {
  return file.parent_path() /
         ("." + file.stem().string() + "." + std::to_string(getpid()) + "." + what + file.extension().string());
}

/// What stood in a file's place, under a second name until the set is complete.
struct Replaced {
  fs::path file, backup;  // backup is empty where nothing stood
};

/// A second name for what stands at `file`; where links are not to be had, its only one.
std::error_code setAside(const fs::path& file, const fs::path& backup) {
  std::error_code ec;
  fs::remove(backup, ec);
  fs::create_hard_link(file, backup, ec);
  if (ec) fs::rename(file, backup, ec);
  return ec;
}

void takeBack(const std::vector<Replaced>& replaced) {
  std::error_code ignored;
  for (auto it = replaced.rbegin(); it != replaced.rend(); ++it) {
    if (it->backup.empty())
      fs::remove(it->file, ignored);
    else
      fs::rename(it->backup, it->file, ignored);
  }
}

}  // namespace

PendingFile::PendingFile(fs::path file) : file_(std::move(file)), temporary_(besides(file_, "part")) {}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : file_(std::move(other.file_)), temporary_(std::exchange(other.temporary_, fs::path())) {}

PendingFile& PendingFile::operator=(PendingFile&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(temporary_, other.temporary_);
  return *this;
}

PendingFile::~PendingFile() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove(temporary_, ignored);
}

Expected<void> putInPlace(std::span<PendingFile> files) {
  std::vector<Replaced> replaced;
  for (PendingFile& pending : files) {
    std::error_code ec;
    Replaced old{pending.file_, {}};
    const fs::file_status there = fs::symlink_status(pending.file_, ec);
    if (fs::is_directory(there)) {
      ec = std::make_error_code(std::errc::is_a_directory);
    } else if (fs::exists(there)) {
      old.backup = besides(pending.file_, "old");
      ec = setAside(pending.file_, old.backup);
    } else {
      ec.clear();
    }
    if (!ec) {
      fs::rename(pending.temporary_, pending.file_, ec);
      replaced.push_back(old);
    }
    if (ec) {
      takeBack(replaced);
      return failure(pending.file_.string() + ": cannot be written: " + ec.message());
    }
  }
  for (PendingFile& pending : files) pending.temporary_.clear();
  std::error_code ignored;
  for (const Replaced& old : replaced)
    if (!old.backup.empty()) fs::remove(old.backup, ignored);
  return {};
}

}  // namespace lumel
