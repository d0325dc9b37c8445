#include "baker/staging.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStagingPrefix = ".lumel-";
constexpr const char* kStagingSuffix = ".part";
// Folders in the staging folder for the files that new ones replace; the second for the last file of the old result.
constexpr const char* kOld = "old";
constexpr const char* kOldLast = "old-last";

Error cannotWrite(const fs::path& file, const std::string& why) {
  return failure(file.string() + ": cannot be written: " + why);
}

Expected<void> flush(const fs::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = descriptor >= 0 && fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (!flushed) return cannotWrite(file, std::strerror(error));
  return {};
}

/// Whether this is the staging folder of a process that is gone.
bool isAbandoned(const std::string& name) {
  const std::size_t prefix = std::strlen(kStagingPrefix);
  const std::size_t suffix = std::strlen(kStagingSuffix);
  if (name.size() <= prefix + suffix || name.rfind(kStagingPrefix, 0) != 0 || !name.ends_with(kStagingSuffix))
    return false;
  pid_t pid = 0;
  const char* end = name.data() + name.size() - suffix;
  const auto parsed = std::from_chars(name.data() + prefix, end, pid);
  if (parsed.ec != std::errc() || parsed.ptr != end || pid <= 0) return false;
  return pid == getpid() || (kill(pid, 0) != 0 && errno != EPERM);
}

std::vector<fs::path> filesIn(const fs::path& dir) {
  std::error_code ec;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(dir, ec)) files.push_back(entry.path());
  return files;
}

/// The last file of the old result comes back last.
void putBack(const fs::path& dir, const fs::path& staging) {
  std::error_code ec;
  for (const char* folder : {kOld, kOldLast})
    for (const fs::path& file : filesIn(staging / folder)) fs::rename(file, dir / file.filename(), ec);
}

}  // namespace

Expected<Staging> Staging::make(const fs::path& dir) {
  std::error_code ec;
  fs::create_directories(dir, ec);
  if (ec) return cannotWrite(dir, ec.message());
  recover(dir);
  Staging staging;
  staging.dir_ = dir;
  staging.path_ = dir / (kStagingPrefix + std::to_string(getpid()) + kStagingSuffix);
  fs::create_directory(staging.path_, ec);
  if (ec) return cannotWrite(staging.path_, ec.message());
  return staging;
}

Staging::~Staging() {
  std::error_code ec;
  if (!path_.empty()) fs::remove_all(path_, ec);
}

void Staging::recover(const fs::path& dir) {
  for (const fs::path& staging : filesIn(dir)) {
    if (!isAbandoned(staging.filename().string())) continue;
    std::error_code ec;
    for (const fs::path& last : filesIn(staging / kOldLast))
      if (!fs::exists(dir / last.filename(), ec)) putBack(dir, staging);
    fs::remove_all(staging, ec);
  }
}

Expected<void> Staging::commit(const std::function<bool(const std::string& name)>& ours) {
  for (const std::string& name : names_)
    if (auto flushed = flush(path_ / name); !flushed) return flushed;
  std::error_code ec;
  for (const std::string& name : names_)
    if (fs::exists(dir_ / name, ec) && !fs::is_regular_file(dir_ / name, ec))
      return cannotWrite(dir_ / name, "something that is not a file has that name");
  for (const char* folder : {kOld, kOldLast}) {
    fs::create_directory(path_ / folder, ec);
    if (ec) return cannotWrite(path_ / folder, ec.message());
  }
  std::vector<std::string> arrived;
  if (auto moved = exchange(ours, arrived); !moved) {
    for (const std::string& name : arrived) fs::remove(dir_ / name, ec);
    putBack(dir_, path_);
    return moved;
  }
  return {};
}

Expected<void> Staging::exchange(const std::function<bool(const std::string& name)>& ours,
                                 std::vector<std::string>& arrived) {
  if (names_.empty()) return {};
  const std::string& last = names_.back();
  std::error_code ec;
  const auto moveAside = [&](const std::string& name, const char* folder) -> Expected<void> {
    if (!fs::is_regular_file(dir_ / name, ec)) return {};
    fs::rename(dir_ / name, path_ / folder / name, ec);
    if (ec) return cannotWrite(dir_ / name, ec.message());
    return {};
  };
  if (auto moved = moveAside(last, kOldLast); !moved) return moved;
  for (const fs::path& file : filesIn(dir_)) {
    const std::string name = file.filename().string();
    if (!ours(name) && std::find(names_.begin(), names_.end(), name) == names_.end()) continue;
    if (auto moved = moveAside(name, kOld); !moved) return moved;
  }
  for (const std::string& name : names_) {
    fs::rename(path_ / name, dir_ / name, ec);
    if (ec) return cannotWrite(dir_ / name, ec.message());
    arrived.push_back(name);
  }
  return {};
}

Expected<void> writeBytes(const fs::path& file, std::string_view bytes) {
  const std::vector<std::uint8_t> piece(bytes.begin(), bytes.end());
  return writeBytes(file, {&piece, 1});
}

Expected<void> writeBytes(const fs::path& file, std::span<const std::vector<std::uint8_t>> pieces) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  for (const std::vector<std::uint8_t>& piece : pieces)
    out.write(reinterpret_cast<const char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
  out.close();
  if (!out) return cannotWrite(file, std::strerror(errno));
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
  const fs::path probe = dir / (kStagingPrefix + std::to_string(getpid()) + ".probe");
  auto written = writeBytes(probe, std::string_view());
  fs::remove(probe, ec);
  if (!made.empty()) fs::remove_all(made, ec);
  if (!written) return cannotWrite(dir, "no file can be made in it");
  return {};
}

}  // namespace lumel
