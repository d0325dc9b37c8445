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

/// Who was killed left the staging folder; the process is gone.
void removeAbandoned(const fs::path& dir) {
  std::error_code ec;
  for (const fs::directory_entry& entry : fs::directory_iterator(dir, ec)) {
    const std::string name = entry.path().filename().string();
    const std::size_t prefix = std::strlen(kStagingPrefix);
    const std::size_t suffix = std::strlen(kStagingSuffix);
    if (name.size() <= prefix + suffix || name.rfind(kStagingPrefix, 0) != 0 || !name.ends_with(kStagingSuffix))
      continue;
    pid_t pid = 0;
    const char* end = name.data() + name.size() - suffix;
    const auto parsed = std::from_chars(name.data() + prefix, end, pid);
    if (parsed.ec != std::errc() || parsed.ptr != end || pid <= 0) continue;
    const bool alive = pid != getpid() && (kill(pid, 0) == 0 || errno == EPERM);
    std::error_code ignored;
    if (!alive) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

Expected<Staging> Staging::make(const fs::path& dir) {
  std::error_code ec;
  fs::create_directories(dir, ec);
  if (ec) return cannotWrite(dir, ec.message());
  removeAbandoned(dir);
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

Expected<void> Staging::commit(const std::function<bool(const std::string& name)>& ours) {
  for (const std::string& name : names_)
    if (auto flushed = flush(path_ / name); !flushed) return flushed;
  std::error_code ec;
  for (const std::string& name : names_) {
    fs::rename(path_ / name, dir_ / name, ec);
    if (ec) return cannotWrite(dir_ / name, ec.message());
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(dir_, ec)) {
    const std::string name = entry.path().filename().string();
    std::error_code ignored;
    if (ours(name) && std::find(names_.begin(), names_.end(), name) == names_.end()) fs::remove(entry.path(), ignored);
  }
  return {};
}

Expected<void> writeBytes(const fs::path& file, const void* data, std::size_t size) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
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
  auto written = writeBytes(probe, "", 0);
  fs::remove(probe, ec);
  if (!made.empty()) fs::remove_all(made, ec);
  if (!written) return cannotWrite(dir, "no file can be made in it");
  return {};
}

}  // namespace lumel
