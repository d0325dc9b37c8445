#include "baker/files/names/file_names.h"

#include <algorithm>
#include <string_view>

#include "lightmap/maps/encoding.h"

namespace lumel {
namespace {

constexpr const char* kAux = "aux";
constexpr const char* kMasks = "masks";
constexpr std::pair<std::string_view, std::string_view> kImageExtensions[] = {
    {"image/png", ".png"},   {"image/jpeg", ".jpg"},       {"image/webp", ".webp"},
    {"image/bmp", ".bmp"},   {"image/tiff", ".tif"},       {"image/vnd.radiance", ".hdr"},
    {"image/x-exr", ".exr"}, {"image/vnd-ms.dds", ".dds"}, {"image/gif", ".gif"}};

/// What follows the prefix and a number, as "-aux.exr" does in "lightmap-12-aux.exr"; empty where a name has no such
/// start.
std::string afterNumber(const std::string& name, std::string_view prefix) {
  if (name.rfind(prefix, 0) != 0) return {};
  const std::size_t end = name.find_first_not_of("0123456789", prefix.size());
  return end == std::string::npos || end == prefix.size() ? std::string() : name.substr(end);
}

bool isImageOf(const std::string& rest, const std::vector<std::string>& kinds) {
  return std::ranges::any_of(kinds, [&rest](const std::string& kind) { return rest == "-" + kind + ".exr"; });
}

bool isPageImage(const std::string& name) {
  const std::string rest = afterNumber(name, "lightmap-");
  return isImageOf(rest, {kFlatMap, kAux, kMasks}) || isImageOf(rest, knownMapNames());
}

bool isSsbumpMap(const std::string& name) {
  const std::string rest = afterNumber(name, "ssbump-");
  return std::ranges::any_of(kImageExtensions, [&rest](const auto& known) { return rest == known.second; });
}

bool isVolumeFile(const std::string& name) {
  const std::string rest = afterNumber(name, "volume-");
  return rest == ".json" || isImageOf(rest, volumeKinds());
}

}  // namespace

std::string pageFileName(std::size_t page, const std::string& kind) {
  return "lightmap-" + std::to_string(page) + "-" + kind + ".exr";
}

std::string ssbumpFileName(int image, const std::string& mimeType) {
  const auto* found = std::find_if(std::begin(kImageExtensions), std::end(kImageExtensions),
                                   [&](const auto& known) { return known.first == mimeType; });
  const std::string extension(found == std::end(kImageExtensions) ? ".png" : found->second);
  return "ssbump-" + std::to_string(image) + extension;
}

std::string volumeFileName(std::size_t volume) { return "volume-" + std::to_string(volume) + ".json"; }

std::string volumeFileName(std::size_t volume, const std::string& kind) {
  return "volume-" + std::to_string(volume) + "-" + kind + ".exr";
}

const std::vector<std::string>& volumeKinds() {
  static const std::vector<std::string> kinds = {"sh0",   "sh1",   "sh2",   "sh3",    "sh4",   "sh5",
                                                 "sh6",   "sh7",   "sh8",   "cube0",  "cube1", "cube2",
                                                 "cube3", "cube4", "cube5", "points", "sight"};
  return kinds;
}

std::vector<std::string> lightKinds(const std::vector<std::string>& mapNames) {
  std::vector<std::string> kinds = mapNames;
  if (std::find(kinds.begin(), kinds.end(), kFlatMap) == kinds.end()) kinds.push_back(kFlatMap);
  return kinds;
}

bool isBakeFile(const std::string& name) {
  return isPageImage(name) || isSsbumpMap(name) || isVolumeFile(name) || name == "sky.exr" || name == "scene.glb" ||
         name == "bake.json";
}

}  // namespace lumel
