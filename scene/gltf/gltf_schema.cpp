#include "scene/gltf/gltf_schema.h"

#include <cfloat>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace lumel {
namespace {

using Json = nlohmann::json;

// Size: a whole number from 0 to 2^63 - 1; Int: to 2^31 - 1.
enum class Type { Index, Indices, Size, Int, Number, Numbers, String, Strings, Bool, Object, Array };

struct Field {
  const char* key;
  Type type;
  const char* target = nullptr;  // Index, Indices: the root array that is referred to
  std::size_t length = 0;        // Numbers: exact length; 0 = any
  bool required = false;
};

constexpr const char* kLights = "extensions/KHR_lights_punctual/lights";

class Checker {
 public:
  explicit Checker(const Json& root) : root_(root) {}

  std::optional<std::string> run();

 private:
  /// Appends a step to the place that messages name, for as long as it lives.
  struct Step {
    Step(Checker& checker, std::string name) : checker_(checker) { checker_.path_.push_back(std::move(name)); }
    ~Step() { checker_.path_.pop_back(); }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;
    Checker& checker_;
  };

  void fail(const std::string& problem);
  std::size_t countOf(const std::string& target) const;
  bool fields(const Json& object, std::span<const Field> list);
  void value(const Json& value, const Field& field);
  void index(const Json& value, const char* target);
  void numbers(const Json& value, std::size_t length);
  template <class Body>
  void forEach(const Json& object, const char* key, const Body& body);
  template <class Body>
  void extension(const Json& object, const char* name, const Body& body);

  void bufferView(const Json& view);
  void meshoptView(const Json& object, const char* name);
  void accessor(const Json& accessor);
  void attributeMap(const Json& object, const char* key, bool required);
  void primitive(const Json& primitive);
  void node(const Json& node);
  void textureInfo(const Json& object, const char* key);
  void material(const Json& material);
  void camera(const Json& camera);
  void light(const Json& light);

  const Json& root_;
  std::vector<std::string> path_;
  std::string problem_;
};

void Checker::fail(const std::string& problem) {
  if (!problem_.empty()) return;
  for (const std::string& step : path_) problem_ += (problem_.empty() ? "" : "/") + step;
  problem_ += (problem_.empty() ? "" : ": ") + problem;
}

std::size_t Checker::countOf(const std::string& target) const {
  const Json* at = &root_;
  if (target == kLights) {
    const Json::json_pointer lights(std::string("/") + kLights);
    if (!root_.contains(lights)) return 0;
    at = &root_.at(lights);
  } else {
    const auto it = root_.find(target);
    if (it == root_.end()) return 0;
    at = &*it;
  }
  return at->is_array() ? at->size() : 0;
}

void Checker::index(const Json& value, const char* target) {
  if (!value.is_number_integer()) return fail("must be an index into " + std::string(target));
  const std::size_t count = countOf(target);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= count)
    fail("is " + value.dump() + ", but there are " + std::to_string(count) + " " + target);
}

void Checker::numbers(const Json& value, std::size_t length) {
  if (!value.is_array()) return fail("must be an array of numbers");
  if (length != 0 && value.size() != length) return fail("must have " + std::to_string(length) + " numbers");
  for (std::size_t i = 0; i < value.size(); ++i)
    if (!value[i].is_number() || !(std::abs(value[i].get<double>()) <= double{FLT_MAX})) {
      const Step step(*this, std::to_string(i));
      return fail("must be a number that a float can hold");
    }
}

void Checker::value(const Json& value, const Field& field) {
  const Step step(*this, field.key);
  switch (field.type) {
    case Type::Index:
      return index(value, field.target);
    case Type::Indices:
      if (!value.is_array()) return fail("must be an array of indices");
      for (std::size_t i = 0; i < value.size(); ++i) {
        const Step inner(*this, std::to_string(i));
        index(value[i], field.target);
      }
      return;
    case Type::Size:
      if (!value.is_number_unsigned() ||
          value.get<std::uint64_t>() > std::uint64_t{std::numeric_limits<std::int64_t>::max()})
        fail("must be a whole number, not negative");
      return;
    case Type::Int:
      if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::uint64_t{std::numeric_limits<int>::max()})
        fail("must be a whole number from 0 to 2147483647");
      return;
    case Type::Number:
      if (!value.is_number() || !(std::abs(value.get<double>()) <= double{FLT_MAX}))
        fail("must be a number that a float can hold");
      return;
    case Type::Numbers:
      return numbers(value, field.length);
    case Type::String:
      if (!value.is_string()) fail("must be a string");
      return;
    case Type::Strings:
      if (!value.is_array()) return fail("must be an array of strings");
      for (const Json& item : value)
        if (!item.is_string()) return fail("must be an array of strings");
      return;
    case Type::Bool:
      if (!value.is_boolean()) fail("must be true or false");
      return;
    case Type::Object:
      if (!value.is_object()) fail("must be an object");
      return;
    case Type::Array:
      if (!value.is_array()) fail("must be an array");
      return;
  }
}

bool Checker::fields(const Json& object, std::span<const Field> list) {
  if (!object.is_object()) {
    fail("must be an object");
    return false;
  }
  for (const Field& field : list) {
    const auto it = object.find(field.key);
    if (it != object.end())
      value(*it, field);
    else if (field.required)
      fail(std::string("has no '") + field.key + "', which is required");
  }
  static constexpr Field kEvery[] = {{"name", Type::String}, {"extensions", Type::Object}};
  if (list.data() != kEvery) return fields(object, kEvery);
  return problem_.empty();
}

template <class Body>
void Checker::forEach(const Json& object, const char* key, const Body& body) {
  const auto it = object.find(key);
  if (it == object.end()) return;
  const Step step(*this, key);
  if (!it->is_array()) return fail("must be an array");
  for (std::size_t i = 0; i < it->size() && problem_.empty(); ++i) {
    const Step inner(*this, std::to_string(i));
    body((*it)[i]);
  }
}

template <class Body>
void Checker::extension(const Json& object, const char* name, const Body& body) {
  const auto extensions = object.find("extensions");
  if (extensions == object.end() || !extensions->is_object()) return;
  const auto it = extensions->find(name);
  if (it == extensions->end()) return;
  const Step step(*this, "extensions");
  const Step inner(*this, name);
  if (!it->is_object()) return fail("must be an object");
  body(*it);
}

void Checker::meshoptView(const Json& object, const char* name) {
  extension(object, name, [&](const Json& compressed) {
    static constexpr Field kFields[] = {{"buffer", Type::Index, "buffers", 0, true},
                                        {"byteOffset", Type::Int},
                                        {"byteLength", Type::Int, nullptr, 0, true},
                                        {"byteStride", Type::Int, nullptr, 0, true},
                                        {"count", Type::Int, nullptr, 0, true},
                                        {"mode", Type::String, nullptr, 0, true},
                                        {"filter", Type::String}};
    fields(compressed, kFields);
  });
}

void Checker::bufferView(const Json& view) {
  static constexpr Field kFields[] = {{"buffer", Type::Index, "buffers", 0, true},
                                      {"byteOffset", Type::Size},
                                      {"byteLength", Type::Size, nullptr, 0, true},
                                      {"byteStride", Type::Size}};
  if (!fields(view, kFields)) return;
  if (const auto stride = view.find("byteStride"); stride != view.end()) {
    const auto bytes = stride->get<std::uint64_t>();
    if (bytes < 4 || bytes > 252 || bytes % 4 != 0)
      return fail("byteStride is " + std::to_string(bytes) + "; it must be a multiple of 4 from 4 to 252");
  }
  meshoptView(view, "EXT_meshopt_compression");
  meshoptView(view, "KHR_meshopt_compression");
}

void Checker::accessor(const Json& accessor) {
  static constexpr Field kFields[] = {{"bufferView", Type::Index, "bufferViews"},
                                      {"byteOffset", Type::Size},
                                      {"componentType", Type::Size, nullptr, 0, true},
                                      {"normalized", Type::Bool},
                                      {"count", Type::Size, nullptr, 0, true},
                                      {"type", Type::String, nullptr, 0, true},
                                      {"sparse", Type::Object}};
  if (!fields(accessor, kFields)) return;
  const auto componentType = accessor["componentType"].get<std::uint64_t>();
  if (componentType < 5120 || componentType > 5126 || componentType == 5124)
    return fail("componentType " + std::to_string(componentType) + " does not exist in glTF 2.0");
  const std::string type = accessor["type"].get<std::string>();
  bool known = false;
  for (const char* name : {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"}) known = known || type == name;
  if (!known) return fail("type '" + type + "' does not exist in glTF 2.0");
  const auto sparse = accessor.find("sparse");
  if (sparse == accessor.end()) return;
  const Step step(*this, "sparse");
  static constexpr Field kSparse[] = {{"count", Type::Int, nullptr, 0, true},
                                      {"indices", Type::Object, nullptr, 0, true},
                                      {"values", Type::Object, nullptr, 0, true}};
  static constexpr Field kPart[] = {{"bufferView", Type::Index, "bufferViews", 0, true}, {"byteOffset", Type::Int}};
  static constexpr Field kIndices[] = {{"componentType", Type::Size, nullptr, 0, true}};
  if (!fields(*sparse, kSparse)) return;
  for (const char* part : {"indices", "values"}) {
    const Step inner(*this, part);
    const Json& object = (*sparse)[part];
    if (!fields(object, kPart) || (part[0] == 'i' && !fields(object, kIndices))) return;
  }
}

void Checker::attributeMap(const Json& object, const char* key, bool required) {
  const auto it = object.find(key);
  if (it == object.end()) {
    if (required) fail(std::string("has no '") + key + "', which is required");
    return;
  }
  const Step step(*this, key);
  if (!it->is_object()) return fail("must be an object");
  for (const auto& [name, accessorIndex] : it->items()) {
    const Step inner(*this, name);
    index(accessorIndex, "accessors");
  }
}

void Checker::primitive(const Json& primitive) {
  static constexpr Field kFields[] = {
      {"indices", Type::Index, "accessors"}, {"material", Type::Index, "materials"}, {"mode", Type::Int}};
  if (!fields(primitive, kFields)) return;
  if (primitive.value("mode", std::uint64_t{4}) > 6) return fail("mode must be 0 to 6");
  attributeMap(primitive, "attributes", true);
  forEach(primitive, "targets", [&](const Json& target) {
    const Json wrapped = {{"target", target}};
    attributeMap(wrapped, "target", true);
  });
  extension(primitive, "KHR_draco_mesh_compression", [&](const Json& draco) {
    static constexpr Field kDraco[] = {{"bufferView", Type::Index, "bufferViews", 0, true},
                                       {"attributes", Type::Object, nullptr, 0, true}};
    if (!fields(draco, kDraco)) return;
    for (const auto& [name, id] : draco["attributes"].items())
      if (!id.is_number_unsigned() || id.get<std::uint64_t>() > 0x7FFFFFFFu)
        fail("attributes/" + name + " must be a Draco attribute id");
  });
}

void Checker::node(const Json& node) {
  static constexpr Field kFields[] = {{"mesh", Type::Index, "meshes"},
                                      {"camera", Type::Index, "cameras"},
                                      {"skin", Type::Index, "skins"},
                                      {"children", Type::Indices, "nodes"},
                                      {"matrix", Type::Numbers, nullptr, 16},
                                      {"translation", Type::Numbers, nullptr, 3},
                                      {"rotation", Type::Numbers, nullptr, 4},
                                      {"scale", Type::Numbers, nullptr, 3},
                                      {"weights", Type::Numbers}};
  if (!fields(node, kFields)) return;
  extension(node, "KHR_lights_punctual", [&](const Json& use) {
    static constexpr Field kLight[] = {{"light", Type::Index, kLights, 0, true}};
    fields(use, kLight);
  });
  extension(node, "EXT_mesh_gpu_instancing", [&](const Json& use) { attributeMap(use, "attributes", true); });
}

void Checker::textureInfo(const Json& object, const char* key) {
  const auto it = object.find(key);
  if (it == object.end()) return;
  const Step step(*this, key);
  static constexpr Field kFields[] = {{"index", Type::Index, "textures", 0, true},
                                      {"texCoord", Type::Int},
                                      {"scale", Type::Number},
                                      {"strength", Type::Number}};
  if (!fields(*it, kFields)) return;
  extension(*it, "KHR_texture_transform", [&](const Json& transform) {
    static constexpr Field kTransform[] = {{"offset", Type::Numbers, nullptr, 2},
                                           {"rotation", Type::Number},
                                           {"scale", Type::Numbers, nullptr, 2},
                                           {"texCoord", Type::Int}};
    fields(transform, kTransform);
  });
}

void Checker::material(const Json& material) {
  static constexpr Field kFields[] = {{"pbrMetallicRoughness", Type::Object},
                                      {"emissiveFactor", Type::Numbers, nullptr, 3},
                                      {"alphaMode", Type::String},
                                      {"alphaCutoff", Type::Number},
                                      {"doubleSided", Type::Bool}};
  if (!fields(material, kFields)) return;
  const std::string alphaMode = material.value("alphaMode", "OPAQUE");
  if (alphaMode != "OPAQUE" && alphaMode != "MASK" && alphaMode != "BLEND")
    return fail("alphaMode '" + alphaMode + "' is not OPAQUE, MASK or BLEND");
  textureInfo(material, "normalTexture");
  textureInfo(material, "emissiveTexture");
  if (const auto pbr = material.find("pbrMetallicRoughness"); pbr != material.end()) {
    const Step step(*this, "pbrMetallicRoughness");
    static constexpr Field kPbr[] = {{"baseColorFactor", Type::Numbers, nullptr, 4},
                                     {"metallicFactor", Type::Number},
                                     {"roughnessFactor", Type::Number}};
    if (!fields(*pbr, kPbr)) return;
    textureInfo(*pbr, "baseColorTexture");
    textureInfo(*pbr, "metallicRoughnessTexture");
  }
  extension(material, "KHR_materials_pbrSpecularGlossiness", [&](const Json& specular) {
    static constexpr Field kSpecular[] = {{"diffuseFactor", Type::Numbers, nullptr, 4}};
    fields(specular, kSpecular);
    textureInfo(specular, "diffuseTexture");
  });
  extension(material, "KHR_materials_transmission", [&](const Json& thin) {
    static constexpr Field kThin[] = {{"transmissionFactor", Type::Number}};
    fields(thin, kThin);
  });
  extension(material, "KHR_materials_emissive_strength", [&](const Json& emissive) {
    static constexpr Field kStrength[] = {{"emissiveStrength", Type::Number}};
    fields(emissive, kStrength);
  });
}

void Checker::camera(const Json& camera) {
  static constexpr Field kFields[] = {{"type", Type::String, nullptr, 0, true}};
  static constexpr Field kPerspective[] = {{"yfov", Type::Number, nullptr, 0, true},
                                           {"znear", Type::Number, nullptr, 0, true},
                                           {"zfar", Type::Number},
                                           {"aspectRatio", Type::Number}};
  static constexpr Field kOrthographic[] = {{"xmag", Type::Number, nullptr, 0, true},
                                            {"ymag", Type::Number, nullptr, 0, true},
                                            {"zfar", Type::Number, nullptr, 0, true},
                                            {"znear", Type::Number, nullptr, 0, true}};
  if (!fields(camera, kFields)) return;
  const std::string type = camera["type"].get<std::string>();
  if (type != "perspective" && type != "orthographic")
    return fail("type '" + type + "' is not perspective or orthographic");
  const auto it = camera.find(type);
  if (it == camera.end()) return fail("has no '" + type + "', which its type asks for");
  const Step step(*this, type);
  fields(*it, type == "perspective" ? std::span<const Field>(kPerspective) : std::span<const Field>(kOrthographic));
}

void Checker::light(const Json& light) {
  static constexpr Field kFields[] = {{"type", Type::String, nullptr, 0, true},
                                      {"color", Type::Numbers, nullptr, 3},
                                      {"intensity", Type::Number},
                                      {"range", Type::Number},
                                      {"spot", Type::Object}};
  static constexpr Field kSpot[] = {{"innerConeAngle", Type::Number}, {"outerConeAngle", Type::Number}};
  if (!fields(light, kFields)) return;
  const std::string type = light["type"].get<std::string>();
  if (type != "point" && type != "spot" && type != "directional")
    return fail("type '" + type + "' is not point, spot or directional");
  const auto spot = light.find("spot");
  if (type == "spot" && spot == light.end()) return fail("has no 'spot', which its type asks for");
  if (spot == light.end()) return;
  const Step step(*this, "spot");
  fields(*spot, kSpot);
}

std::optional<std::string> Checker::run() {
  static constexpr Field kRoot[] = {
      {"extensionsUsed", Type::Strings}, {"extensionsRequired", Type::Strings}, {"scene", Type::Index, "scenes"}};
  static constexpr Field kBuffer[] = {{"uri", Type::String}, {"byteLength", Type::Size, nullptr, 0, true}};
  static constexpr Field kImage[] = {
      {"uri", Type::String}, {"mimeType", Type::String}, {"bufferView", Type::Index, "bufferViews"}};
  static constexpr Field kTexture[] = {{"source", Type::Index, "images"}, {"sampler", Type::Index, "samplers"}};
  static constexpr Field kWebp[] = {{"source", Type::Index, "images"}};
  static constexpr Field kSampler[] = {{"magFilter", Type::Int}, {"wrapS", Type::Int}, {"wrapT", Type::Int}};
  static constexpr Field kScene[] = {{"nodes", Type::Indices, "nodes"}};
  static constexpr Field kMesh[] = {{"primitives", Type::Array, nullptr, 0, true}, {"weights", Type::Numbers}};
  static constexpr Field kSkin[] = {{"joints", Type::Indices, "nodes", 0, true},
                                    {"inverseBindMatrices", Type::Index, "accessors"}};

  extension(root_, "KHR_lights_punctual",
            [&](const Json& lights) { forEach(lights, "lights", [&](const Json& item) { light(item); }); });
  forEach(root_, "buffers", [&](const Json& item) { fields(item, kBuffer); });
  forEach(root_, "bufferViews", [&](const Json& item) { bufferView(item); });
  forEach(root_, "accessors", [&](const Json& item) { accessor(item); });
  forEach(root_, "images", [&](const Json& item) { fields(item, kImage); });
  forEach(root_, "samplers", [&](const Json& item) { fields(item, kSampler); });
  forEach(root_, "textures", [&](const Json& item) {
    if (!fields(item, kTexture)) return;
    extension(item, "EXT_texture_webp", [&](const Json& webp) { fields(webp, kWebp); });
  });
  forEach(root_, "materials", [&](const Json& item) { material(item); });
  forEach(root_, "cameras", [&](const Json& item) { camera(item); });
  forEach(root_, "meshes", [&](const Json& item) {
    if (fields(item, kMesh)) forEach(item, "primitives", [&](const Json& p) { primitive(p); });
  });
  forEach(root_, "skins", [&](const Json& item) { fields(item, kSkin); });
  forEach(root_, "nodes", [&](const Json& item) { node(item); });
  forEach(root_, "scenes", [&](const Json& item) { fields(item, kScene); });
  fields(root_, kRoot);
  if (problem_.empty()) return std::nullopt;
  return problem_;
}

}  // namespace

std::optional<std::string> checkGltfSchema(const nlohmann::json& root) {
  if (!root.is_object()) return "the document must be a JSON object";
  return Checker(root).run();
}

}  // namespace lumel
