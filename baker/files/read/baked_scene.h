// A bake as a consumer finds it: read from the files of its folder alone, never from the baker's memory.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lightmap/maps/encoding.h"
#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

struct BakedScene {
  Scene scene;                                               // scene.glb, with the sky of the bake as its environment
  std::shared_ptr<const Encoding> encoding = rnmEncoding();  // the one that was asked for, as bake.json says
  std::vector<std::vector<Image>> pages;                     // the encoding's maps, page by page
  std::vector<Image> flat;                                   // the flat map, page by page
  std::vector<Image> aux;                                    // what is known of texels (PageExtras), page by page
  std::vector<std::string> auxChannels;                      // "coverage", ...
  std::vector<LightVolume> volumes;  // as the bake has them
  Vec3 meanFlat{0, 0, 0};                                    // mean irradiance / pi over all covered texels
};

/// bake.json, parsed and checked for its format. Errors: Input, naming the file.
Expected<nlohmann::ordered_json> readBakeJson(const std::filesystem::path& dir);

/// The encoding of a bake, of the conventions that bake.json states. A bake without an "encoding" is one of rnm: it was
/// the only one before there was that key, and differs in nothing else. Errors: Input, naming place and cause.
/// `name`: of one of the bake's encodings; empty: the first.
Expected<std::shared_ptr<const Encoding>> encodingOf(const nlohmann::ordered_json& bake, const std::string& file,
                                                     const std::string& name = {});
/// The names of all encodings of a bake, the first one first.
std::vector<std::string> encodingNames(const nlohmann::ordered_json& bake);

/// Which encoding's maps are read, the first's unless it is named, and which of a page's images beside them.
struct PageExtras {
  std::string encoding{};
  bool flat = false;
  bool aux = false;
  bool volumes = false;  // of the whole bake
};

/// Reads bake.json, scene.glb, the encoding's maps and the sky. Every page that a node or primitive names
/// exists. Errors: Input, naming the file that is missing, unreadable or does not fit the others.
Expected<BakedScene> readBake(const std::filesystem::path& dir, const PageExtras& extras = {});

}  // namespace lumel
