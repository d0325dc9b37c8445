#include "baker/files/read/baked_volumes.h"

#include <cmath>
#include <fstream>
#include <iterator>

#include "baker/files/names/file_names.h"
#include "baker/files/read/json_reader.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

/// More points would take more than this machine has; what a file claims is not trusted.
constexpr double kMostPoints = 1 << 26;

/// The grid without its light.
Expected<LightVolume> readGrid(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
  if (json.is_discarded()) return inputError(path.string() + ": not JSON");
  const JsonReader root(json, path.string());
  const auto format = root.numberAt("format");
  if (!format) return format.error();
  if (*format != 1.0)
    return inputError(path.string() + ": format " + std::to_string(*format) + " is not known; bake again");
  const auto name = root.textAt("name");
  if (!name) return name.error();
  const auto origin = root.vectorAt("origin"), cell = root.vectorAt("cell"), counts = root.vectorAt("counts");
  for (const auto* value : {&origin, &cell, &counts})
    if (!*value) return value->error();
  LightVolume volume{.name = *name, .origin = *origin, .cell = *cell, .counts = {}, .points = {}};
  double points = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float count = (*counts)[axis];
    if (!(count >= 1.0f) || count != std::floor(count) || !((*cell)[axis] > 0.0f))
      return inputError(path.string() + ": counts and cell are not those of a grid");
    points *= static_cast<double>(count);
    volume.counts[static_cast<std::size_t>(axis)] = static_cast<int>(std::min(count, 1e9f));
  }
  if (points > kMostPoints) return inputError(path.string() + ": more points than a volume may have");
  return volume;
}

Expected<Image> readKind(const fs::path& dir, std::size_t number, const std::string& kind, const LightVolume& volume,
                         int side, int channels) {
  const fs::path path = dir / volumeFileName(number, kind);
  auto loaded = readImage(path);
  if (!loaded) return loaded.error();
  Image& image = loaded->image;
  if (image.width != volume.counts[0] * side || image.height != volume.counts[1] * volume.counts[2] * side ||
      image.channels != channels)
    return inputError(path.string() + ": its size is not that of the volume; bake again");
  return std::move(image);
}

Expected<void> readPlaces(const fs::path& dir, std::size_t number, LightVolume& volume) {
  const auto points = readKind(dir, number, "points", volume, 1, 4);
  if (!points) return points.error();
  const auto sight = readKind(dir, number, "sight", volume, kSightSide, 1);
  if (!sight) return sight.error();
  // Not before images of that size are there: a description may claim more than memory holds.
  volume.points.resize(points->pixels.size() / 4);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    VolumePoint& point = volume.points[i];
    const float* values = points->pixels.data() + 4 * i;
    point.offset = {values[0], values[1], values[2]};
    point.isValid = values[3] > 0.5f;
    const int column = static_cast<int>(i) % volume.counts[0], row = static_cast<int>(i) / volume.counts[0];
    for (std::size_t s = 0; s < kSights; ++s)
      point.nearness[s] = *sight->at(column * kSightSide + static_cast<int>(s) % kSightSide,
                                     row * kSightSide + static_cast<int>(s) / kSightSide);
  }
  return {};
}

Expected<void> readLight(const fs::path& dir, std::size_t number, LightVolume& volume) {
  const auto readColors = [&](const std::string& kind, const auto& target) -> Expected<void> {
    const auto image = readKind(dir, number, kind, volume, 1, 3);
    if (!image) return image.error();
    for (std::size_t i = 0; i < volume.points.size(); ++i) {
      const float* pixel = image->pixels.data() + 3 * i;
      target(volume.points[i]) = Vec3(pixel[0], pixel[1], pixel[2]);
    }
    return {};
  };
  for (std::size_t k = 0; k < kHarmonics; ++k)
    if (auto done = readColors("sh" + std::to_string(k), [k](VolumePoint& p) -> Vec3& { return p.harmonics[k]; });
        !done)
      return done;
  for (std::size_t k = 0; k < kCubeFaces; ++k)
    if (auto done = readColors("cube" + std::to_string(k), [k](VolumePoint& p) -> Vec3& { return p.cube[k]; }); !done)
      return done;
  return {};
}

}  // namespace

Expected<std::vector<LightVolume>> readVolumes(const fs::path& dir) {
  std::vector<LightVolume> volumes;
  for (std::size_t number = 0; fs::exists(dir / volumeFileName(number)); ++number) {
    auto volume = readGrid(dir / volumeFileName(number));
    if (!volume) return volume.error();
    if (auto done = readPlaces(dir, number, *volume); !done) return done.error();
    if (auto done = readLight(dir, number, *volume); !done) return done.error();
    volumes.push_back(*std::move(volume));
  }
  return volumes;
}

}  // namespace lumel
