#include "baker/export/engine_scene.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "scene/files/file_access.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kFloatType = 5126, kArrayBuffer = 34962;

std::uint32_t wordAt(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) word |= static_cast<std::uint32_t>(bytes[at + i]) << 8 * i;
  return word;
}
void putWord(std::vector<std::uint8_t>& bytes, std::size_t word) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
}

Error notOurs(const std::filesystem::path& file) {
  return inputError(file.string() + ": not a scene.glb that lumel wrote; bake again");
}

Json* lumelOf(Json& object) {
  const auto extras = object.find("extras");
  if (extras == object.end() || !extras->is_object()) return nullptr;
  const auto own = extras->find("lumel");
  return own == extras->end() || !own->is_object() ? nullptr : &*own;
}

Vec2 vectorIn(const Json& json, const char* key, const Vec2& usual) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array() || found->size() != 2 || !(*found)[0].is_number() ||
      !(*found)[1].is_number())
    return usual;
  return {(*found)[0].get<float>(), (*found)[1].get<float>()};
}

int pageIn(const Json* lumel, int usual) {
  if (!lumel) return usual;
  const auto found = lumel->find("page");
  return found != lumel->end() && found->is_number_integer() ? found->get<int>() : usual;
}

/// Makes names that tell nodes apart.
class Names {
 public:
  explicit Names(bool godot) : godot_(godot) {}

  std::string unique(std::string name) {
    if (name.empty()) name = "Node";
    if (godot_) {
      for (char& c : name)
        if (std::strchr(".:@/\"%$-", c)) c = '_';
      if (isHint(name)) name += "_lit_";
    }
    std::string candidate = name;
    for (int i = 2; !used_.insert(candidate).second; ++i) candidate = name + "_" + std::to_string(i);
    return candidate;
  }

 private:
  /// Endings that Godot's importer takes for orders ("import hints"), with digits after them.
  static bool isHint(std::string name) {
    name = lowerCase(name);
    while (!name.empty() && name.back() >= '0' && name.back() <= '9') name.pop_back();
    return std::ranges::any_of(std::array{"_noimp", "_col", "_convcol", "_colonly", "_convcolonly", "_occ", "_occonly",
                                          "_navmesh", "_rigid", "_vehicle", "_wheel", "_loop", "_cycle"},
                               [&name](const char* hint) { return name.ends_with(hint); });
  }

  bool godot_;
  std::set<std::string> used_;
};

class Editor {
 public:
  Editor(Glb glb, const EngineSceneOptions& options) : options_(options), names_(options.godotNames) {
    scene_.glb = std::move(glb);
  }

  EngineScene run() {
    Json& json = scene_.glb.json;
    const std::size_t count = json.contains("nodes") ? json["nodes"].size() : 0;
    for (std::size_t i = 0; i < count; ++i) editNode(i);
    if (!options_.keepLights) dropUnusedLights();
    return std::move(scene_);
  }

 private:
  void editNode(std::size_t index) {
    Json& nodes = scene_.glb.json["nodes"];
    nodes[index]["name"] = names_.unique(nodes[index].value("name", std::string()));
    if (!options_.keepLights) dropBakedLight(nodes[index]);
    if (!nodes[index].contains("mesh")) return;
    const auto mesh = nodes[index]["mesh"].get<std::size_t>();
    std::map<int, std::vector<std::size_t>> byPage;
    const Json& primitives = scene_.glb.json["meshes"][mesh]["primitives"];
    const int own = pageIn(lumelOf(nodes[index]), -1);
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      Json primitive = primitives[p];
      const bool hasUvs = primitive["attributes"].contains("TEXCOORD_1");
      byPage[hasUvs ? pageIn(lumelOf(primitive), own) : -1].push_back(p);
    }
    const Json original = nodes[index];
    bool isFirst = true;
    for (const auto& [page, chosen] : byPage) {
      Json node = original;
      node["mesh"] = byPage.size() == 1 ? mesh : partOf(mesh, page, chosen);
      if (!isFirst) node["name"] = names_.unique(original["name"].get<std::string>() + "_page" + std::to_string(page));
      place(node, page);
      if (isFirst) {
        nodes[index] = std::move(node);
      } else {
        scene_.glb.json["scenes"][0]["nodes"].push_back(nodes.size());
        nodes.push_back(std::move(node));
      }
      isFirst = false;
    }
  }

  /// States where the node's lightmap lies.
  void place(Json& node, int page) {
    Json* lumel = lumelOf(node);
    if (page < 0) {
      if (lumel)
        for (const char* key : {"page", "scale", "offset"}) lumel->erase(key);
      return;
    }
    LightmapPlace where{page, lumel ? vectorIn(*lumel, "scale", Vec2(1.0f)) : Vec2(1.0f),
                        lumel ? vectorIn(*lumel, "offset", Vec2(0.0f)) : Vec2(0.0f)};
    const Vec2 most = where.scale + where.offset;
    const auto isInside = [](const Vec2& v) { return v.x >= 0 && v.y >= 0 && v.x <= 1 && v.y <= 1; };
    if (options_.unitPlaces && !(isInside(where.offset) && isInside(most))) {
      node["mesh"] = withPageUvs(node["mesh"].get<std::size_t>(), where);
      where = {page, Vec2(1.0f), Vec2(0.0f)};
    }
    Json& own = node["extras"]["lumel"];
    own["page"] = page;
    own["scale"] = {where.scale.x, where.scale.y};
    own["offset"] = {where.offset.x, where.offset.y};
    scene_.nodes.push_back({node["name"].get<std::string>(), where});
  }

  /// A mesh of some primitives of another, which state no page any more.
  std::size_t partOf(std::size_t mesh, int page, const std::vector<std::size_t>& chosen) {
    const auto [known, isNew] = parts_.emplace(std::pair(mesh, page), scene_.glb.json["meshes"].size());
    if (!isNew) return known->second;
    Json part = scene_.glb.json["meshes"][mesh];
    Json primitives = Json::array();
    for (const std::size_t p : chosen) {
      primitives.push_back(part["primitives"][p]);
      if (Json* lumel = lumelOf(primitives.back())) lumel->erase("page");
    }
    part["primitives"] = std::move(primitives);
    scene_.glb.json["meshes"].push_back(std::move(part));
    return known->second;
  }

  std::size_t withPageUvs(std::size_t mesh, const LightmapPlace& where) {
    Json copy = scene_.glb.json["meshes"][mesh];
    for (Json& primitive : copy["primitives"]) {
      const auto accessor = primitive["attributes"]["TEXCOORD_1"].get<std::size_t>();
      std::vector<Vec2> uvs = readUvs(accessor);
      for (Vec2& uv : uvs) uv = where.apply(uv);
      primitive["attributes"]["TEXCOORD_1"] = addUvs(uvs);
    }
    scene_.glb.json["meshes"].push_back(std::move(copy));
    return scene_.glb.json["meshes"].size() - 1;
  }

  std::vector<Vec2> readUvs(std::size_t index) const {
    const Json& accessor = scene_.glb.json.at("accessors").at(index);
    const Json& view = scene_.glb.json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
    const auto count = accessor.at("count").get<std::size_t>();
    const std::size_t start = view.value("byteOffset", std::size_t{0}) + accessor.value("byteOffset", std::size_t{0});
    const std::size_t size = scene_.glb.binary.size();
    if (start > size || count > (size - start) / sizeof(Vec2)) throw std::out_of_range("UVs beyond the buffer");
    std::vector<Vec2> uvs(count);
    std::memcpy(uvs.data(), scene_.glb.binary.data() + start, count * sizeof(Vec2));
    return uvs;
  }

  std::size_t addUvs(const std::vector<Vec2>& uvs) {
    Json& json = scene_.glb.json;
    std::vector<std::uint8_t>& binary = scene_.glb.binary;
    const std::size_t start = binary.size(), size = uvs.size() * sizeof(Vec2);
    binary.resize(start + size);
    std::memcpy(binary.data() + start, uvs.data(), size);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", start}, {"byteLength", size}, {"target", kArrayBuffer}});
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", kFloatType},
                                 {"count", uvs.size()},
                                 {"type", "VEC2"}});
    json["buffers"][0]["byteLength"] = binary.size();
    return json["accessors"].size() - 1;
  }

  /// Takes a lamp from its node unless it says that the maps lack its light or part of it.
  static void dropBakedLight(Json& node) {
    Json* lumel = lumelOf(node);
    const auto own = lumel ? lumel->find("light") : Json::iterator();
    const bool hasOwn = lumel && own != lumel->end();
    if (hasOwn && own->is_object() && own->value("mode", Json("all")) != Json("all")) return;
    if (hasOwn) lumel->erase("light");
    const auto extensions = node.find("extensions");
    if (extensions == node.end() || !extensions->is_object()) return;
    extensions->erase("KHR_lights_punctual");
    if (extensions->empty()) node.erase("extensions");
  }

  void dropUnusedLights() {
    Json& json = scene_.glb.json;
    for (const Json& node : json.value("nodes", Json::array()))
      if (node.contains("extensions") && node["extensions"].contains("KHR_lights_punctual")) return;
    if (json.contains("extensions")) {
      json["extensions"].erase("KHR_lights_punctual");
      if (json["extensions"].empty()) json.erase("extensions");
    }
    if (!json.contains("extensionsUsed")) return;
    Json used = Json::array();
    for (const Json& name : json["extensionsUsed"])
      if (name != Json("KHR_lights_punctual")) used.push_back(name);
    if (used.empty())
      json.erase("extensionsUsed");
    else
      json["extensionsUsed"] = std::move(used);
  }

  const EngineSceneOptions options_;
  Names names_;
  EngineScene scene_;
  std::map<std::pair<std::size_t, int>, std::size_t> parts_;
};

}  // namespace

Expected<Glb> Glb::read(const std::filesystem::path& file) {
  const auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  if (bytes->size() < 20 || wordAt(*bytes, 0) != kMagic || wordAt(*bytes, 16) != kJsonChunk) return notOurs(file);
  const std::size_t size = wordAt(*bytes, 12);
  if (20 + size > bytes->size()) return notOurs(file);
  Glb glb;
  glb.json = Json::parse(bytes->begin() + 20, bytes->begin() + 20 + static_cast<std::ptrdiff_t>(size), nullptr, false);
  if (!glb.json.is_object()) return notOurs(file);
  const std::size_t binary = 20 + size;
  if (binary + 8 <= bytes->size() && wordAt(*bytes, binary + 4) == kBinaryChunk) {
    const std::size_t length = wordAt(*bytes, binary);
    if (binary + 8 + length > bytes->size()) return notOurs(file);
    glb.binary.assign(bytes->begin() + static_cast<std::ptrdiff_t>(binary + 8),
                      bytes->begin() + static_cast<std::ptrdiff_t>(binary + 8 + length));
  }
  return glb;
}

std::vector<std::uint8_t> Glb::bytes() const {
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (binary.size() + 3) / 4 * 4;
  std::vector<std::uint8_t> out;
  putWord(out, kMagic);
  putWord(out, 2);
  putWord(out, 20 + text.size() + (padded > 0 ? 8 + padded : 0));
  putWord(out, text.size());
  putWord(out, kJsonChunk);
  out.insert(out.end(), text.begin(), text.end());
  if (padded > 0) {
    putWord(out, padded);
    putWord(out, kBinaryChunk);
    out.insert(out.end(), binary.begin(), binary.end());
    out.resize(out.size() + padded - binary.size(), 0);
  }
  return out;
}

Expected<EngineScene> engineScene(const std::filesystem::path& dir, const EngineSceneOptions& options) {
  auto glb = Glb::read(dir / "scene.glb");
  if (!glb) return glb.error();
  try {
    return Editor(*std::move(glb), options).run();
  } catch (const Json::exception&) {
    return notOurs(dir / "scene.glb");
  } catch (const std::out_of_range&) {
    return notOurs(dir / "scene.glb");
  }
}

}  // namespace lumel
