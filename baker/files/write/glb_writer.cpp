#include "baker/files/write/glb_writer.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <set>
#include <span>

#include "baker/files/names/version.h"
#include "baker/files/write/glb_buffer.h"
#include "baker/files/write/glb_materials.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

/// A primitive that gets no lightmap, moved to world space like the surfaces.
struct PlacedPrimitive {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  std::vector<std::uint32_t> sourceVertex;
  std::vector<std::uint32_t> indices;
};

/// One triangle list as it goes into the file, whatever it came from.
struct Geometry {
  std::span<const Vec3> positions;
  std::span<const Vec3> normals;
  std::span<const Vec4> tangents;
  std::span<const Vec2> lightmapUvs;            // empty without a lightmap
  std::span<const std::uint32_t> sourceVertex;  // into the source primitive
  std::span<const std::uint32_t> indices;

  explicit Geometry(const Surface& s)
      : positions(s.positions),
        normals(s.normals),
        tangents(s.tangents),
        lightmapUvs(s.lightmapUvs),
        sourceVertex(s.sourceVertex),
        indices(s.indices) {}
  explicit Geometry(const PlacedPrimitive& p)
      : positions(p.positions),
        normals(p.normals),
        tangents(p.tangents),
        sourceVertex(p.sourceVertex),
        indices(p.indices) {}
};

PlacedPrimitive place(const Primitive& primitive, const Mat4& worldFromObject) {
  const Mat3 linear(worldFromObject);
  const bool mirrors = glm::determinant(linear) < 0.0f;
  const Mat3 normalMatrix = cofactorMatrix(linear) * (mirrors ? -1.0f : 1.0f);
  const auto unit = [](const Vec3& v, const Vec3& otherwise) {
    const float length = glm::length(v);
    return length > 0.0f && std::isfinite(length) ? v / length : otherwise;
  };
  PlacedPrimitive g;
  for (const Vec3& p : primitive.positions) g.positions.push_back(Vec3(worldFromObject * Vec4(p, 1.0f)));
  for (const Vec3& n : primitive.normals) g.normals.push_back(unit(normalMatrix * n, Vec3(0, 1, 0)));
  for (const Vec4& t : primitive.tangents)
    g.tangents.push_back(Vec4(unit(linear * Vec3(t), Vec3(1, 0, 0)), mirrors ? -t.w : t.w));
  g.sourceVertex.resize(primitive.positions.size());
  std::iota(g.sourceVertex.begin(), g.sourceVertex.end(), 0u);
  g.indices = primitive.indices;
  if (mirrors)
    for (std::size_t i = 0; i + 2 < g.indices.size(); i += 3) std::swap(g.indices[i + 1], g.indices[i + 2]);
  return g;
}

std::set<int> uvSetsOf(const Material& m) {
  std::set<int> sets;
  for (const TextureRef* ref : {&m.baseColorMap, &m.metallicRoughnessMap, &m.normalMap, &m.emissionMap})
    if (*ref) sets.insert(ref->uvSet);
  return sets;
}

class GlbWriter {
 public:
  GlbWriter(const Scene& scene, const Atlas& atlas) : scene_(scene), atlas_(atlas) {}

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
    std::size_t next = 0;  // surfaces are ordered by instance, then primitive
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      const Mesh& mesh = scene_.meshes[toSize(instance.mesh)];
      Json primitives = Json::array();
      std::vector<bool> written(mesh.primitives.size(), false);
      for (; next < atlas_.surfaces.size() && atlas_.surfaces[next].instance == static_cast<int>(i); ++next) {
        const Surface& surface = atlas_.surfaces[next];
        written[toSize(surface.primitive)] = true;
        if (surface.indices.empty()) continue;
        Json json = describe(Geometry(surface), mesh.primitives[toSize(surface.primitive)]);
        json["extras"]["lumel"]["page"] = surface.page;
        primitives.push_back(std::move(json));
      }
      for (std::size_t k = 0; k < mesh.primitives.size(); ++k)
        if (!written[k] && !mesh.primitives[k].indices.empty())
          primitives.push_back(
              describe(Geometry(place(mesh.primitives[k], instance.worldFromObject)), mesh.primitives[k]));
      if (primitives.empty()) continue;
      Json node = {{"name", instance.name}, {"mesh", meshes_.size()}};
      addSettings(node, instance.settings);
      meshes_.push_back(
          {{"name", mesh.name.empty() ? instance.name : mesh.name}, {"primitives", std::move(primitives)}});
      addNode(std::move(node));
    }
  }

  static void addSettings(Json& node, const ObjectSettings& settings) {
    const ObjectSettings usual;
    if (settings.texelDensityScale != usual.texelDensityScale)
      node["extras"]["lumel"]["scale"] = settings.texelDensityScale;
    if (settings.casts != usual.casts) node["extras"]["lumel"]["casts"] = settings.casts;
    if (settings.receives != usual.receives) node["extras"]["lumel"]["receives"] = settings.receives;
  }

  Json describe(const Geometry& g, const Primitive& source) {
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
  void addUvs(Json& attributes, const Geometry& g, const Primitive& source) {
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

  void addLights() {
    for (const Light& light : scene_.lights) {
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

  const Scene& scene_;
  const Atlas& atlas_;
  GlbBuffer buffer_;
  Json nodes_ = Json::array();
  Json rootNodes_ = Json::array();
  Json meshes_ = Json::array();
  Json lights_ = Json::array();
  Json cameras_ = Json::array();
};

}  // namespace

Expected<std::vector<std::vector<std::uint8_t>>> encodeGlb(const Scene& scene, const Atlas& atlas) {
  return GlbWriter(scene, atlas).write();
}

}  // namespace lumel
