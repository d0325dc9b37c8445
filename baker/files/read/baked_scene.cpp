#include "baker/files/read/baked_scene.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "baker/files/names/bake_format.h"
#include "baker/files/names/file_names.h"
#include "baker/files/read/baked_volumes.h"
#include "baker/files/read/json_reader.h"
#include "scene/images/image_io.h"
#include "scene/load/load_scene.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Expected<void> readPages(const JsonReader& root, const fs::path& dir, const PageExtras& extras, BakedScene& baked) {
  const auto pages = root.at("pages");
  if (!pages) return pages.error();
  if (!pages->json().is_array()) return pages->wrong("a list");
  double texels = 0.0;
  Vec3d light(0.0);
  for (std::size_t i = 0; i < pages->json().size(); ++i) {
    const JsonReader page(pages->json()[i], (dir / "bake.json").string(), "/pages/" + std::to_string(i));
    const auto width = page.numberAt("width");
    const auto height = page.numberAt("height");
    const auto covered = page.numberAt("coveredTexels");
    const auto mean = page.vectorAt("meanFlat");
    for (const Expected<double>* number : {&width, &height, &covered})
      if (!*number) return number->error();
    if (!mean) return mean.error();
    texels += *covered;
    light += Vec3d(*mean) * *covered;
    std::vector<Image>& maps = baked.pages.emplace_back();
    std::vector<std::string> names = baked.encoding->mapNames();
    if (extras.flat) names.push_back("flat");
    if (extras.aux) names.push_back("aux");
    for (std::size_t k = 0; k < names.size(); ++k) {
      const fs::path file = dir / pageFileName(i, names[k]);
      auto loaded = readImage(file);
      if (!loaded) return loaded.error();
      const bool isAux = extras.aux && k + 1 == names.size();
      if ((loaded->image.channels != 3 && !isAux) || loaded->image.width != static_cast<int>(*width) ||
          loaded->image.height != static_cast<int>(*height))
        return inputError(file.string() + ": its size or channels differ from bake.json; bake again");
      if (isAux) baked.auxChannels = loaded->channelNames;
      std::vector<Image>& into = k < baked.encoding->mapCount() ? maps : isAux ? baked.aux : baked.flat;
      into.push_back(std::move(loaded->image));
    }
  }
  if (texels > 0.0) baked.meanFlat = Vec3(light / texels);
  return {};
}

Expected<void> readSky(const JsonReader& root, const fs::path& dir, Environment& sky) {
  sky = Environment{};
  const auto json = root.at("sky");
  if (!json) return json.error();
  if (json->json().is_null()) return {};
  const auto strength = json->numberAt("strength");
  if (!strength) return strength.error();
  sky.strength = static_cast<float>(*strength);
  if (!json->json().contains("file")) {
    const auto color = json->vectorAt("color");
    if (!color) return color.error();
    sky.color = *color;
    return {};
  }
  const auto rotation = json->numberAt("rotationDegrees");
  if (!rotation) return rotation.error();
  sky.rotationDegrees = static_cast<float>(*rotation);
  auto loaded = readImage(dir / "sky.exr");
  if (!loaded) return loaded.error();
  if (loaded->image.channels != 3) return inputError((dir / "sky.exr").string() + ": not an RGB image");
  sky.image = std::move(loaded->image);
  return {};
}

Expected<void> checkPages(const BakedScene& baked, const fs::path& file) {
  for (const Instance& instance : baked.scene.instances)
    for (const Primitive& primitive : baked.scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      const int page = instance.lightmapPageOf(primitive);
      if (page < 0) continue;
      const std::string name = file.string() + ": '" + instance.name + "', " + primitive.name;
      if (static_cast<std::size_t>(page) >= baked.pages.size())
        return inputError(name + " lies on page " + std::to_string(page) + ", bake.json knows " +
                          std::to_string(baked.pages.size()) + "; bake again");
      if (primitive.uvSets.size() < 2 || primitive.uvSets[1].empty())
        return inputError(name + " has a lightmap page but no TEXCOORD_1; bake again");
    }
  return {};
}

}  // namespace

Expected<Json> readBakeJson(const fs::path& dir) {
  const fs::path file = dir / "bake.json";
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open() || in.bad())
    return inputError(file.string() + ": cannot be read; give the folder that lumel bake -o wrote");
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return inputError(file.string() + ": not valid JSON; bake again");
  if (json.value("format", Json()) != Json(kBakeFormat))
    return inputError(file.string() + ": its format is not " + std::to_string(kBakeFormat) +
                      ", the one that this version reads; bake again");
  return json;
}

std::vector<std::string> encodingNames(const Json& bake) {
  std::vector<std::string> names;
  const Json all = bake.value("encodings", Json::array());
  if (all.is_array())
    for (const Json& row : all)
      if (row.is_object() && row.value("name", Json()).is_string()) names.push_back(row.at("name").get<std::string>());
  if (!names.empty()) return names;
  const Json only = bake.value("encoding", Json());
  const bool isNamed = only.is_object() && only.value("name", Json()).is_string();
  return {isNamed ? only.at("name").get<std::string>() : "rnm"};
}

Expected<std::shared_ptr<const Encoding>> encodingOf(const Json& bake, const std::string& file,
                                                     const std::string& wanted) {
  const std::vector<std::string> names = encodingNames(bake);
  const auto found = wanted.empty() ? names.begin() : std::find(names.begin(), names.end(), wanted);
  if (found == names.end()) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ",") + name;
    return inputError(file + ": the bake holds " + list + " and not " + wanted + "; bake with --encoding " + list +
                      "," + wanted);
  }
  const JsonReader root(bake, file);
  std::string name = "rnm";
  if (bake.contains("encoding")) {
    const auto stated = root.at("encoding")->textAt("name");
    if (!stated) return stated.error();
    name = *stated;
  }
  auto stated = root.at("conventions");
  if (found != names.begin()) {
    name = *found;
    const JsonReader row(bake.at("encodings")[static_cast<std::size_t>(found - names.begin())], file,
                     "/encodings/" + std::to_string(found - names.begin()));
    stated = row.at("conventions");
  }
  if (!stated) return stated.error();
  Conventions conventions;
  for (const auto& [key, text] : stated->json().items())
    if (text.is_string()) conventions[key] = text.get<std::string>();
  auto encoding = findEncoding(name, conventions);
  if (encoding) return encoding;
  const Json version = bake.value("lumel", Json());
  return inputError(file + ": " + encoding.error().message + "; use version " +
                    (version.is_string() ? version.get<std::string>() : "?") + ", which baked it, or bake again");
}

Expected<BakedScene> readBake(const fs::path& dir, const PageExtras& extras) {
  const auto json = readBakeJson(dir);
  if (!json) return json.error();
  const std::string file = (dir / "bake.json").string();
  const JsonReader root(*json, file);
  BakedScene baked;
  auto encoding = encodingOf(*json, file, extras.encoding);
  if (!encoding) return encoding.error();
  baked.encoding = std::move(*encoding);
  auto scene = loadScene(dir / "scene.glb");
  if (!scene) return scene.error();
  baked.scene = std::move(*scene);
  if (auto done = readSky(root, dir, baked.scene.environment); !done) return done.error();
  if (auto done = readPages(root, dir, extras, baked); !done) return done.error();
  if (extras.volumes) {
    auto volumes = readVolumes(dir);
    if (!volumes) return volumes.error();
    baked.volumes = *std::move(volumes);
  }
  if (auto done = checkPages(baked, dir / "scene.glb"); !done) return done.error();
  return baked;
}

}  // namespace lumel
