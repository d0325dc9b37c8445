#include "baker/files/write/volume_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "baker/files/names/file_names.h"
#include "baker/files/names/version.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Vec3& v) { return {v.x, v.y, v.z}; }

Json describe(std::size_t number, const LightVolume& volume) {
  const auto files = [&](const std::string& kind, std::size_t count) {
    Json names = Json::array();
    for (std::size_t i = 0; i < count; ++i) names.push_back(volumeFileName(number, kind + std::to_string(i)));
    return names;
  };
  Json json;
  json["format"] = 1;
  json["lumel"] = kVersion;
  json["name"] = volume.name;
  json["origin"] = toJson(volume.origin);
  json["cell"] = toJson(volume.cell);
  json["counts"] = volume.counts;
  json["valid"] = std::ranges::count(volume.points, true, &VolumePoint::isValid);
  json["layout"] =
      "point (x, y, z) lies at origin + (x, y, z) * cell, world space in metres; in images it is column x "
      "of row y + counts[1] * z, rows from the top";
  json["units"] = "linear Rec. 709; irradiance / pi is radiance of a white surface, in nits";
  json["bases"]["sh"] = {
      {"files", files("sh", kHarmonics)},
      {"order", "Y00, Y1-1 (y), Y10 (z), Y11 (x), Y2-2 (xy), Y2-1 (yz), Y20 (3zz-1), Y21 (xz), Y22 (xx-yy)"},
      {"holds", "integral over the sphere of radiance times Y of the direction that it comes from"},
      {"decodeFormula",
       "irradiance / pi = sum of band * sh * Y(normal), band 1, 2/3, 1/4; the first four alone for two "
       "bands; mean radiance = 0.28209479 * sh0"}};
  json["bases"]["cube"] = {{"files", files("cube", kCubeFaces)},
                           {"order", "+x, -x, +y, -y, +z, -z"},
                           {"holds", "irradiance / pi on the face"},
                           {"decodeFormula",
                            "irradiance / pi = sum over the three axes of normal[axis]^2 times the "
                            "face that it points to"}};
  json["points"] = {{"file", volumeFileName(number, "points")},
                    {"channels",
                     "R, G, B: metres from the grid's point to where its light was gathered; A: 0 "
                     "inside of things, where the light is that of points around"}};
  json["sight"] = {{"file", volumeFileName(number, "sight")},
                   {"side", kSightSide},
                   {"holds",
                    "1 / metres to what is seen from a point, 8 x 8 texels each: directions through their "
                    "middles by the octahedral map (column: x, row: y, both from -1; z = 1 - |x| - |y|); 0: "
                    "nothing. A place farther off than 1.2 times that is hidden from the point"}};
  return json;
}

/// Width and height of an image of which a point takes side x side pixels.
Image imageFor(const LightVolume& volume, int side, int channels) {
  return Image(volume.counts[0] * side, volume.counts[1] * volume.counts[2] * side, channels);
}

template <class Value>
Image lightImage(const LightVolume& volume, const Value& value) {
  Image image = imageFor(volume, 1, 3);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const Vec3& v = value(volume.points[i]);
    std::copy_n(&v.x, 3, image.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return image;
}

Image pointImage(const LightVolume& volume) {
  Image image = imageFor(volume, 1, 4);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const VolumePoint& point = volume.points[i];
    const float values[] = {point.offset.x, point.offset.y, point.offset.z, point.isValid ? 1.0f : 0.0f};
    std::copy_n(values, 4, image.pixels.begin() + static_cast<std::ptrdiff_t>(4 * i));
  }
  return image;
}

Image sightImage(const LightVolume& volume) {
  Image image = imageFor(volume, kSightSide, 1);
  for (std::size_t i = 0; i < volume.points.size(); ++i) {
    const auto column = static_cast<int>(i) % volume.counts[0], row = static_cast<int>(i) / volume.counts[0];
    for (std::size_t s = 0; s < kSights; ++s)
      *image.at(column * kSightSide + static_cast<int>(s) % kSightSide,
                row * kSightSide + static_cast<int>(s) / kSightSide) = volume.points[i].nearness[s];
  }
  return image;
}

}  // namespace

Expected<void> writeVolume(FileSet& set, const std::filesystem::path& dir, std::size_t number,
                           const LightVolume& volume, bool half) {
  WriteImageOptions options;
  options.format = half ? PixelFormat::Half : PixelFormat::Float;
  options.metadata = {{"lumel:version", kVersion}, {"lumel:volume", volumeFileName(number)}};
  const auto write = [&](const std::string& kind, const Image& image) -> Expected<void> {
    auto file = set.add(dir / volumeFileName(number, kind));
    if (!file) return file.error();
    return writeImage(*file, image, options);
  };
  for (std::size_t k = 0; k < kHarmonics; ++k)
    if (auto done = write("sh" + std::to_string(k),
                          lightImage(volume, [k](const VolumePoint& p) -> const Vec3& { return p.harmonics[k]; }));
        !done)
      return done;
  for (std::size_t k = 0; k < kCubeFaces; ++k)
    if (auto done = write("cube" + std::to_string(k),
                          lightImage(volume, [k](const VolumePoint& p) -> const Vec3& { return p.cube[k]; }));
        !done)
      return done;
  if (auto done = write("sight", sightImage(volume)); !done) return done;
  if (auto done = write("points", pointImage(volume)); !done) return done;
  auto file = set.add(dir / volumeFileName(number));
  if (!file) return file.error();
  return writeBytes(*file, describe(number, volume).dump(1) + "\n");
}

}  // namespace lumel
