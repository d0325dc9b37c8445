#include "baker/files/write/glb_writer.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <span>

#include "baker/files/names/version.h"
#include "baker/files/write/glb_buffer.h"
#include "baker/files/write/glb_materials.h"
#include "baker/files/write/glb_objects.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63u];
  }
  return text;
}

std::set<int> uvSetsOf(const Material& m) {
  std::set<int> sets;
  for (const TextureRef* ref :
       {&m.baseColorMap, &m.metallicRoughnessMap, &m.normalMap, &m.emissionMap, &m.occlusionMap, &m.ssbumpMap})
    if (*ref) sets.insert(ref->uvSet);
  return sets;
}

class GlbWriter {
 public:
  GlbWriter(const Scene& scene, const Atlas& atlas, SceneForm form) : scene_(scene), atlas_(atlas), form_(form) {}

  Expected<std::vector<std::vector<std::uint8_t>>> write() {
    auto materials = describeMaterials(scene_, buffer_);
    if (!materials) return materials.error();
    addInstances();
    addLights();
    addCameras();
    return assemble(*materials);
  }

 private:
  void addNode(Json node) {
    rootNodes_.push_back(nodes_.size());
    nodes_.push_back(std::move(node));
  }

  void addInstances() {
    const std::span<const Surface> all(atlas_.surfaces);
    std::size_t next = 0;  // surfaces are ordered by instance, then primitive
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const std::size_t first = next;
      while (next < all.size() && all[next].instance == static_cast<int>(i)) ++next;
      addInstance(i, all.subspan(first, next - first));
    }
  }

  void addInstance(std::size_t index, std::span<const Surface> surfaces) {
    const Instance& instance = scene_.instances[index];
    Json node = {{"name", instance.name}, {"mesh", 0}};
    if (form_ == SceneForm::Flattened || !isNodeTransform(instance.worldFromObject)) {
      std::vector<GlbPart> parts = partsInWorld(scene_, instance, surfaces);
      if (parts.empty()) return;
      node["mesh"] = addMesh(instance, parts, true);
    } else {
      const bool hasPlace = index < atlas_.places.size() && atlas_.places[index].page >= 0;
      std::vector<GlbPart> parts = partsInObject(scene_, instance, surfaces, hasPlace);
      if (parts.empty()) return;
      // Where only some primitives have a lightmap, or they lie on several pages, they say so themselves.
      const bool pagesDiffer =
          std::any_of(parts.begin(), parts.end(), [&](const GlbPart& p) { return p.page != parts[0].page; });
      node["mesh"] = hasPlace || surfaces.empty() ? sharedMesh(instance, std::move(parts), pagesDiffer)
                                                  : addMesh(instance, parts, pagesDiffer);
      if (instance.worldFromObject != Mat4(1.0f)) node["matrix"] = toJson(instance.worldFromObject);
      if (!surfaces.empty() && (hasPlace || !pagesDiffer)) {
        const LightmapPlace place = hasPlace ? atlas_.places[index] : LightmapPlace{surfaces[0].page};
        Json& extras = node["extras"]["lumel"];
        if (!pagesDiffer) extras["page"] = place.page;
        extras["scale"] = {place.scale.x, place.scale.y};
        extras["offset"] = {place.offset.x, place.offset.y};
      }
    }
    addSettings(node, instance.settings);
    addNode(std::move(node));
  }

  std::size_t addMesh(const Instance& instance, std::span<const GlbPart> parts, bool pages) {
    const Mesh& mesh = scene_.meshes[toSize(instance.mesh)];
    Json primitives = Json::array();
    for (const GlbPart& part : parts) {
      Json json = describe(part, mesh.primitives[toSize(part.primitive)]);
      if (pages && part.page >= 0) json["extras"]["lumel"]["page"] = part.page;
      primitives.push_back(std::move(json));
    }
    meshes_.push_back({{"name", mesh.name.empty() ? instance.name : mesh.name}, {"primitives", std::move(primitives)}});
    return meshes_.size() - 1;
  }

  /// The mesh that an earlier instance of equal look wrote, or a new one. Equal pages too, if the mesh states them.
  std::size_t sharedMesh(const Instance& instance, std::vector<GlbPart> parts, bool pages) {
    std::vector<SharedMesh>& known = shared_[instance.mesh];
    for (const SharedMesh& mesh : known)
      if (mesh.pages == pages && sameButForPages(mesh.parts, parts) &&
          (!pages || std::equal(parts.begin(), parts.end(), mesh.parts.begin(),
                                [](const GlbPart& a, const GlbPart& b) { return a.page == b.page; })))
        return mesh.index;
    const std::size_t index = addMesh(instance, parts, pages);
    known.push_back({index, pages, std::move(parts)});
    return index;
  }

  static void addSettings(Json& node, const ObjectSettings& settings) {
    const ObjectSettings usual;
    if (settings.texelDensityScale != usual.texelDensityScale)
      node["extras"]["lumel"]["density"] = settings.texelDensityScale;
    if (settings.casts != usual.casts) node["extras"]["lumel"]["casts"] = settings.casts;
    if (settings.receives != usual.receives) node["extras"]["lumel"]["receives"] = settings.receives;
  }

  Json describe(const GlbPart& g, const Primitive& source) {
    Json attributes = {{"POSITION", buffer_.addVec3(g.positions, true)}, {"NORMAL", buffer_.addVec3(g.normals)}};
    if (!g.tangents.empty()) attributes["TANGENT"] = buffer_.addVec4(g.tangents);
    addUvs(attributes, g, source);
    if (!source.colors.empty()) {
      std::vector<Vec4> colors;
      for (std::uint32_t v : g.sourceVertex) colors.push_back(source.colors[v]);
      attributes["COLOR_0"] = buffer_.addVec4(colors);
    }
    return {{"attributes", std::move(attributes)},
            {"indices", buffer_.addIndices(g.indices, g.positions.size())},
            {"material", source.material}};
  }

  /// TEXCOORD numbers must follow each other from 0, so sets in between that nobody reads repeat another's data.
  void addUvs(Json& attributes, const GlbPart& g, const Primitive& source) {
    std::set<int> wanted = uvSetsOf(scene_.materials[toSize(source.material)]);
    if (!source.uvSets.empty() && !source.uvSets[0].empty()) wanted.insert(0);
    std::vector<int> accessors;  // by written set; -1: nothing of its own
    for (int set : wanted) {
      const std::size_t written = toSize(writtenUvSet(set));
      if (accessors.size() <= written) accessors.resize(written + 1, -1);
      std::vector<Vec2> uvs(g.sourceVertex.size(), Vec2(0.0f));  // a missing set reads as (0, 0)
      if (toSize(set) < source.uvSets.size() && !source.uvSets[toSize(set)].empty())
        for (std::size_t v = 0; v < uvs.size(); ++v) uvs[v] = source.uvSets[toSize(set)][g.sourceVertex[v]];
      accessors[written] = buffer_.addVec2(uvs);
    }
    if (!g.lightmapUvs.empty()) {
      if (accessors.size() <= kLightmapUvSet) accessors.resize(kLightmapUvSet + 1, -1);
      accessors[kLightmapUvSet] = buffer_.addVec2(g.lightmapUvs);
    }
    const auto any = std::find_if(accessors.begin(), accessors.end(), [](int a) { return a >= 0; });
    for (std::size_t set = 0; set < accessors.size(); ++set)
      attributes["TEXCOORD_" + std::to_string(set)] = accessors[set] >= 0 ? accessors[set] : *any;
  }

  /// What KHR_lights_punctual does not hold of a lamp; null: nothing.
  static Json lightSettings(const Light& light) {
    Json json;
    if (!isPunctual(light.type)) {
      json["type"] = nameOf(light.type);
      json[unitOf(light.type)] = light.intensity;
      json["color"] = {light.color.x, light.color.y, light.color.z};
    }
    if (light.type == LightType::Rectangle) json["size"] = {light.size.x, light.size.y};
    if (light.radius > 0.0f || light.type == LightType::Sphere) json["radius"] = light.radius;
    if (light.halfAngle > 0.0f) json["angle"] = light.halfAngle * 360.0f * kInvPi;
    if (light.profile) json["ies"] = "data:application/octet-stream;base64," + base64(light.profile->text);
    if (light.mode != LightMode::All) json["mode"] = nameOf(light.mode);
    if (light.hasShadowMask) json["shadow_mask"] = true;
    return json;
  }

  /// A lamp of a kind that glTF does not have: a node with settings alone.
  void addOwnLight(const Light& light, Json settings) {
    Json node = {{"extras", {{"lumel", {{"light", std::move(settings)}}}}}};
    if (!light.name.empty()) node["name"] = light.name;
    node["matrix"] = toJson(frameOf(light));
    addNode(std::move(node));
  }
  static Mat4 frameOf(const Light& light) {
    return Mat4(Vec4(light.right, 0), Vec4(light.up, 0), Vec4(-light.direction, 0), Vec4(light.position, 1));
  }

  void addLights() {
    for (const Light& light : scene_.lights) {
      Json settings = lightSettings(light);
      if (!isPunctual(light.type)) {
        addOwnLight(light, std::move(settings));
        continue;
      }
      Json json = {{"type", nameOf(light.type)},
                   {"color", {light.color.x, light.color.y, light.color.z}},
                   {"intensity", light.intensity}};
      if (!light.name.empty()) json["name"] = light.name;
      if (light.range > 0.0f && light.type != LightType::Directional) json["range"] = light.range;
      if (light.type == LightType::Spot)
        json["spot"] = {{"innerConeAngle", light.innerConeAngle}, {"outerConeAngle", light.outerConeAngle}};
      Json node = {{"extensions", {{"KHR_lights_punctual", {{"light", lights_.size()}}}}}};
      if (!light.name.empty()) node["name"] = light.name;
      // A light shines along its node's -z.
      const Frame frame = frameAround(-light.direction);
      node["matrix"] = toJson(Mat4(Vec4(frame.t, 0), Vec4(frame.b, 0), Vec4(frame.n, 0), Vec4(light.position, 1)));
      if (light.profile) node["matrix"] = toJson(frameOf(light));
      if (!settings.is_null()) node["extras"]["lumel"]["light"] = std::move(settings);
      lights_.push_back(std::move(json));
      addNode(std::move(node));
    }
  }

  static Json toJson(const Mat4& matrix) {
    Json json = Json::array();
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) json.push_back(matrix[column][row]);
    return json;
  }

  void addCameras() {
    for (const Camera& camera : scene_.cameras) {
      // glTF wants both far and near planes in orthographic cameras; nothing here depends on them.
      constexpr float kNear = 0.01f;
      constexpr float kFar = 10000.0f;
      Json json;
      if (!camera.name.empty()) json["name"] = camera.name;
      if (camera.orthographic) {
        const float aspect = camera.aspect > 0.0f ? camera.aspect : 1.0f;
        json["type"] = "orthographic";
        json["orthographic"] = {
            {"xmag", camera.yExtent * aspect}, {"ymag", camera.yExtent}, {"zfar", kFar}, {"znear", kNear}};
      } else {
        json["type"] = "perspective";
        json["perspective"] = {{"yfov", camera.yFov}, {"znear", kNear}};
        if (camera.aspect > 0.0f) json["perspective"]["aspectRatio"] = camera.aspect;
      }
      Json node = {{"camera", cameras_.size()}, {"matrix", toJson(camera.worldFromCamera)}};
      if (!camera.name.empty()) node["name"] = camera.name;
      cameras_.push_back(std::move(json));
      addNode(std::move(node));
    }
  }

  Expected<std::vector<std::vector<std::uint8_t>>> assemble(GlbMaterials& materials) {
    Json root = {{"asset", {{"version", "2.0"}, {"generator", std::string("Lumel ") + kVersion}}}, {"scene", 0}};
    Json scene = Json::object();
    if (!rootNodes_.empty()) scene["nodes"] = rootNodes_;
    root["scenes"] = Json::array({std::move(scene)});
    if (!lights_.empty()) {
      root["extensions"]["KHR_lights_punctual"]["lights"] = std::move(lights_);
      materials.extensionsUsed.insert("KHR_lights_punctual");
    }
    if (!materials.extensionsUsed.empty()) root["extensionsUsed"] = materials.extensionsUsed;
    if (!materials.extensionsRequired.empty()) root["extensionsRequired"] = materials.extensionsRequired;
    const auto put = [&](const char* key, const Json& array) {
      if (!array.empty()) root[key] = array;  // glTF does not allow empty arrays
    };
    put("nodes", nodes_);
    put("meshes", meshes_);
    put("cameras", cameras_);
    put("materials", materials.materials);
    put("textures", materials.textures);
    put("images", materials.images);
    put("samplers", materials.samplers);
    put("accessors", buffer_.accessors());
    put("bufferViews", buffer_.bufferViews());
    if (buffer_.size() > 0) root["buffers"] = Json::array({{{"byteLength", buffer_.size()}}});
    // Names come from files and need not be valid UTF-8.
    return container(root.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

  /// The GLB container (glTF 2.0, 4.4): a header and two chunks padded to four bytes, JSON with spaces.
  Expected<std::vector<std::vector<std::uint8_t>>> container(std::string json) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::size_t binary = buffer_.size();  // views are padded
    const std::size_t total = 12 + 8 + json.size() + (binary > 0 ? 8 + binary : 0);
    if (total > 0xFFFFFFFFu)
      return failure("scene.glb: " + std::to_string(total >> 20) +
                     " MiB are more than a GLB can hold; split the scene");
    std::vector<std::uint8_t> out;
    const auto word = [&](std::size_t value) {
      for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
    };
    word(0x46546C67);  // "glTF"
    word(2);
    word(total);
    word(json.size());
    word(0x4E4F534A);  // "JSON"
    out.insert(out.end(), json.begin(), json.end());
    if (binary > 0) {
      word(binary);
      word(0x004E4942);  // "BIN"
    }
    std::vector<std::vector<std::uint8_t>> pieces = buffer_.takePieces();
    pieces.insert(pieces.begin(), std::move(out));
    return pieces;
  }

  struct SharedMesh {
    std::size_t index = 0;  // into meshes_
    bool pages = false;     // its primitives state their pages
    std::vector<GlbPart> parts;
  };

  const Scene& scene_;
  const Atlas& atlas_;
  const SceneForm form_;
  std::map<int, std::vector<SharedMesh>> shared_;  // by mesh of the scene
  GlbBuffer buffer_;
  Json nodes_ = Json::array();
  Json rootNodes_ = Json::array();
  Json meshes_ = Json::array();
  Json lights_ = Json::array();
  Json cameras_ = Json::array();
};

}  // namespace

Expected<std::vector<std::vector<std::uint8_t>>> encodeGlb(const Scene& scene, const Atlas& atlas, SceneForm form) {
  return GlbWriter(scene, atlas, form).write();
}

}  // namespace lumel
