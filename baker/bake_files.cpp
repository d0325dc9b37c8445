#include "baker/bake_files.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>

#include "baker/bake_json.h"
#include "baker/conventions.h"
#include "baker/glb_writer.h"
#include "baker/version.h"
#include "scene/image_io.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStagingPrefix = ".lumel-";
constexpr const char* kStagingSuffix = ".part";
constexpr const char* kOld = "old";  // in the staging folder: the files that the new ones replace
constexpr const char* kBakeJson = "bake.json";

Error cannotWrite(const fs::path& file, const std::string& why) {
  return failure(file.string() + ": cannot be written: " + why);
}

bool isPageImage(const std::string& name) {
  constexpr std::string_view prefix = "lightmap-";
  if (name.rfind(prefix, 0) != 0) return false;
  const std::size_t dash = name.find_first_not_of("0123456789", prefix.size());
  if (dash == std::string::npos || dash == prefix.size()) return false;
  const std::string rest = name.substr(dash);
  return rest == "-rnm0.exr" || rest == "-rnm1.exr" || rest == "-rnm2.exr" || rest == "-flat.exr" || rest == "-aux.exr";
}

/// The folder in which a result is made whole. Removed with all it holds unless committed.
class Staging {
 public:
  static Expected<Staging> make(const fs::path& dir) {
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

  Staging(Staging&& other) noexcept { swap(other); }
  Staging& operator=(Staging&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Staging() {
    std::error_code ec;
    if (!path_.empty()) fs::remove_all(path_, ec);
  }

  /// Where to write a file of the result.
  fs::path file(const std::string& name) {
    names_.push_back(name);
    return path_ / name;
  }

  /// Puts the new files in the place of the old ones, which stay in the staging folder until that is done: if a step
  /// fails, all is put back. bake.json goes first and comes last, so no reader takes a mixture for a bake.
  Expected<void> commit() {
    for (const std::string& name : names_)
      if (auto flushed = flush(path_ / name); !flushed) return flushed;
    std::error_code ec;
    for (const std::string& name : names_)
      if (fs::exists(dir_ / name, ec) && !fs::is_regular_file(dir_ / name, ec))
        return cannotWrite(dir_ / name, "something that is not a file has that name");
    fs::create_directory(path_ / kOld, ec);
    if (ec) return cannotWrite(path_ / kOld, ec.message());
    std::vector<std::string> arrived;
    if (auto moved = exchange(arrived); !moved) {
      for (const std::string& name : arrived) fs::remove(dir_ / name, ec);
      putBack(dir_, path_);
      return moved;
    }
    return {};
  }

  /// What bakes that were killed left behind: what they had not written is removed, and an old bake that one was about
  /// to replace is put back.
  static void recover(const fs::path& dir) {
    std::error_code ec;
    std::vector<fs::path> abandoned;
    for (const fs::directory_entry& entry : fs::directory_iterator(dir, ec))
      if (isAbandoned(entry.path().filename().string())) abandoned.push_back(entry.path());
    for (const fs::path& staging : abandoned) {
      if (!fs::exists(dir / kBakeJson, ec)) putBack(dir, staging);
      fs::remove_all(staging, ec);
    }
  }

 private:
  Staging() = default;
  void swap(Staging& other) {
    std::swap(dir_, other.dir_);
    std::swap(path_, other.path_);
    std::swap(names_, other.names_);
  }

  static Expected<void> flush(const fs::path& file) {
    const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    const bool flushed = descriptor >= 0 && fsync(descriptor) == 0;
    const int error = errno;
    if (descriptor >= 0) close(descriptor);
    if (!flushed) return cannotWrite(file, std::strerror(error));
    return {};
  }

  /// bake.json first among the old files to leave, last among the new ones to arrive.
  Expected<void> exchange(std::vector<std::string>& arrived) {
    std::vector<std::string> old = {kBakeJson};
    std::error_code ec;
    for (const fs::directory_entry& entry : fs::directory_iterator(dir_, ec))
      if (const std::string name = entry.path().filename().string(); isPageImage(name) || name == "sky.exr" || name == "scene.glb")
        old.push_back(name);
    for (const std::string& name : old)
      if (fs::is_regular_file(dir_ / name, ec)) {
        fs::rename(dir_ / name, path_ / kOld / name, ec);
        if (ec) return cannotWrite(dir_ / name, ec.message());
      }
    for (const std::string& name : names_) {
      fs::rename(path_ / name, dir_ / name, ec);
      if (ec) return cannotWrite(dir_ / name, ec.message());
      arrived.push_back(name);
    }
    return {};
  }

  static void putBack(const fs::path& dir, const fs::path& staging) {
    std::error_code ec;
    for (const fs::directory_entry& entry : fs::directory_iterator(staging / kOld, ec))
      if (const fs::path name = entry.path().filename(); name != kBakeJson) {
        std::error_code ignored;
        fs::rename(entry.path(), dir / name, ignored);
      }
    fs::rename(staging / kOld / kBakeJson, dir / kBakeJson, ec);
  }

  /// Whether this is the staging folder of a process that is gone.
  static bool isAbandoned(const std::string& name) {
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

  fs::path dir_;
  fs::path path_;
  std::vector<std::string> names_;
};

Expected<void> writeBytes(const fs::path& file, const void* data, std::size_t size) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
  out.close();
  if (!out) return cannotWrite(file, std::strerror(errno));
  return {};
}

std::map<std::string, std::string> pageMetadata(std::size_t page, const std::string& kind, const BakeRecord& record) {
  std::map<std::string, std::string> metadata;
  for (const auto& [key, text] : describeConventions(record.bakeOptions.projection)) metadata["lumel:" + key] = text;
  metadata["lumel:version"] = kVersion;
  metadata["lumel:page"] = std::to_string(page);
  metadata["lumel:map"] = kind;
  metadata["lumel:integrator"] = record.bakeOptions.integrator == Integrator::Gather ? "gather" : "path";
  metadata["lumel:samples"] = std::to_string(record.bakeOptions.samples);
  metadata["lumel:bounces"] = record.bakeOptions.bounces < 0 ? "all" : describeBounces(record.bakeOptions.bounces);
  metadata["lumel:seed"] = std::to_string(record.bakeOptions.seed);
  metadata["lumel:dilate"] = std::to_string(record.dilate);
  if (kind == "aux") {
    metadata["lumel:units"] =
        "coverage: area share 0..1; validity: share of gather rays that met no back face; stderr: standard error of "
        "the "
        "flat map's luminance; samples: gather rays";
    for (const char* key : {"decode", "decodeFormula", "basis", "order"}) metadata.erase(std::string("lumel:") + key);
  }
  return metadata;
}

Expected<void> writePage(Staging& staging, std::size_t page, const BakedPage& baked, const BakeRecord& record) {
  WriteImageOptions options;
  options.format = record.half ? PixelFormat::Half : PixelFormat::Float;
  const auto write = [&](const std::string& kind, const Image& image) {
    options.metadata = pageMetadata(page, kind, record);
    return writeImage(staging.file(pageFileName(page, kind)), image, options);
  };
  for (std::size_t i = 0; i < 3; ++i)
    if (auto done = write("rnm" + std::to_string(i), baked.rnm[i]); !done) return done;
  if (auto done = write("flat", baked.flat); !done) return done;
  // Sample counts and coverage are exact in float only.
  options.format = PixelFormat::Float;
  options.channelNames = {"coverage", "validity", "stderr", "samples"};
  return write("aux", baked.aux);
}

}  // namespace

std::string pageFileName(std::size_t page, const std::string& kind) {
  return "lightmap-" + std::to_string(page) + "-" + kind + ".exr";
}

void recoverBake(const fs::path& dir) { Staging::recover(dir); }

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

Expected<void> writeBake(const fs::path& dir, const Scene& scene, const AtlasResult& atlas, const BakeResult& result,
                         const BakeRecord& record) {
  auto staging = Staging::make(dir);
  if (!staging) return staging.error();
  for (std::size_t page = 0; page < result.pages.size(); ++page)
    if (auto done = writePage(*staging, page, result.pages[page], record); !done) return done;
  if (!scene.environment.isBlack() && !scene.environment.image.empty())
    if (auto done = writeImage(staging->file("sky.exr"), scene.environment.image); !done) return done;
  const auto glb = encodeGlb(scene, atlas.atlas);
  if (!glb) return glb.error();
  if (auto done = writeBytes(staging->file("scene.glb"), glb->data(), glb->size()); !done) return done;
  const std::string json = describeBake(scene, atlas, result, record);
  if (auto done = writeBytes(staging->file(kBakeJson), json.data(), json.size()); !done) return done;
  return staging->commit();
}

}  // namespace lumel
