#include "scene/gltf/gltf_attributes.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "scene/gltf/gltf_accessor.h"
#include "scene/gltf/gltf_draco.h"
#include "scene/gltf/gltf_skin.h"

namespace lumel {
namespace {

// UV sets beyond this are left out (with a warning): nothing reads them.
constexpr int kMaxUvSets = 8;

class AttributeReader {
 public:
  AttributeReader(const GltfDocument& document, const tinygltf::Primitive& source, const std::string& place)
      : document_(document), source_(source), place_(place) {}

  std::optional<Error> openDraco();
  bool has(const std::string& name) const { return source_.attributes.count(name) != 0; }
  int accessor(const std::string& name) const { return source_.attributes.at(name); }
  int components(const std::string& name) const;

  /// The attribute as an array of T with `vertices` elements.
  template <class T>
  Expected<std::vector<T>> read(const std::string& name, std::size_t vertices) const;
  /// The number of vertices, from POSITION.
  std::size_t vertexCount() const;
  Expected<std::vector<std::uint32_t>> indices(std::size_t vertices) const;

 private:
  const DracoAttribute* compressed(const std::string& name) const {
    if (!draco_) return nullptr;
    const auto it = draco_->attributes.find(name);
    return it == draco_->attributes.end() ? nullptr : &it->second;
  }

  const GltfDocument& document_;
  const tinygltf::Primitive& source_;
  const std::string& place_;
  std::optional<DracoMesh> draco_;
};

std::optional<Error> AttributeReader::openDraco() {
  const auto* extension = findExtension(source_.extensions, "KHR_draco_mesh_compression");
  if (!extension) return std::nullopt;
  const std::string place = place_ + "/extensions/KHR_draco_mesh_compression";
  std::map<std::string, int> ids;
  const auto& attributes = extension->Get("attributes");
  if (attributes.IsObject())
    for (const std::string& name : attributes.Keys()) ids[name] = attributes.Get(name).GetNumberAsInt();
  auto bytes = document_.viewBytes(static_cast<int>(valueNumber(*extension, "bufferView", 0)));
  if (!bytes) return bytes.error();
  auto mesh = decodeDraco(*bytes, ids);
  if (!mesh) return document_.error(place, mesh.error().message + "; export again");
  draco_ = *std::move(mesh);
  return std::nullopt;
}

int AttributeReader::components(const std::string& name) const {
  const auto* attribute = compressed(name);
  return attribute ? attribute->components : accessorComponents(document_, accessor(name));
}

std::size_t AttributeReader::vertexCount() const {
  return draco_ ? draco_->vertexCount : document_.model.accessors[static_cast<std::size_t>(accessor("POSITION"))].count;
}

template <class T>
Expected<std::vector<T>> AttributeReader::read(const std::string& name, std::size_t vertices) const {
  const std::string place = place_ + "/attributes/" + name;
  if (const auto* attribute = compressed(name)) {
    if (attribute->components != static_cast<int>(sizeof(T) / sizeof(float)))
      return document_.error(place, "has " + std::to_string(attribute->components) + " components");
    const auto& format = document_.model.accessors[static_cast<std::size_t>(accessor(name))];
    std::vector<T> values(vertices);
    float* out = reinterpret_cast<float*>(values.data());
    // Draco hands integers over unscaled; the accessor says whether and how they are normalised.
    for (std::size_t i = 0; i < attribute->values.size(); ++i)
      out[i] = format.normalized ? normalizedToFloat(attribute->values[i], format.componentType) : attribute->values[i];
    return values;
  }
  const std::size_t count = document_.model.accessors[static_cast<std::size_t>(accessor(name))].count;
  if (count != vertices)
    return document_.error(place, "has " + std::to_string(count) + " elements, but there are " +
                                      std::to_string(vertices) + " vertices; export again");
  return readArray<T>(document_, accessor(name));
}

Expected<std::vector<std::uint32_t>> AttributeReader::indices(std::size_t vertices) const {
  if (draco_) return draco_->indices;
  if (source_.indices < 0) {
    std::vector<std::uint32_t> made(vertices);
    std::iota(made.begin(), made.end(), 0u);
    return made;
  }
  auto read = readIntegers(document_, source_.indices);
  if (!read) return read.error();
  for (std::size_t i = 0; i < read->size(); ++i)
    if ((*read)[i] >= vertices)
      return document_.error(place_ + "/indices", "entry " + std::to_string(i) + " is " + std::to_string((*read)[i]) +
                                                      ", but there are " + std::to_string(vertices) +
                                                      " vertices; export again");
  return read;
}

template <class T>
std::optional<Error> addMorph(const GltfDocument& document, const std::string& place, int accessor, double weight,
                              std::vector<T>& values) {
  auto offsets = readArray<Vec3>(document, accessor);
  if (!offsets) return offsets.error();
  if (offsets->size() != values.size())
    return document.error(place, "a target has " + std::to_string(offsets->size()) + " elements, but there are " +
                                     std::to_string(values.size()) + " vertices");
  for (std::size_t v = 0; v < values.size(); ++v)
    for (int c = 0; c < 3; ++c) values[v][c] += static_cast<float>(weight) * (*offsets)[v][c];
  return std::nullopt;
}

std::optional<Error> applyMorphs(const GltfDocument& document, const tinygltf::Primitive& source,
                                 const std::string& place, const MeshUse& use, Primitive& primitive) {
  const auto& mesh = document.model.meshes[static_cast<std::size_t>(use.mesh)];
  const auto& weights = use.weights.empty() ? mesh.weights : use.weights;
  for (std::size_t t = 0; t < std::min(weights.size(), source.targets.size()); ++t) {
    if (weights[t] == 0) continue;
    for (const auto& [name, accessor] : source.targets[t]) {
      const std::string where = place + "/targets/" + std::to_string(t) + "/" + name;
      std::optional<Error> error;
      if (name == "POSITION") error = addMorph(document, where, accessor, weights[t], primitive.positions);
      if (name == "NORMAL" && !primitive.normals.empty())
        error = addMorph(document, where, accessor, weights[t], primitive.normals);
      if (name == "TANGENT" && !primitive.tangents.empty())
        error = addMorph(document, where, accessor, weights[t], primitive.tangents);
      if (error) return error;
    }
  }
  return std::nullopt;
}

std::optional<Error> readColors(const AttributeReader& reader, std::size_t vertices, Primitive& primitive) {
  if (reader.components("COLOR_0") == 3) {
    auto rgb = reader.read<Vec3>("COLOR_0", vertices);
    if (!rgb) return rgb.error();
    for (const Vec3& color : *rgb) primitive.colors.emplace_back(color, 1.0f);
  } else {
    auto rgba = reader.read<Vec4>("COLOR_0", vertices);
    if (!rgba) return rgba.error();
    primitive.colors = *std::move(rgba);
  }
  for (Vec4& color : primitive.colors)
    for (int c = 0; c < 4; ++c) color[c] = std::isfinite(color[c]) ? std::clamp(color[c], 0.0f, 1.0f) : 1.0f;
  return std::nullopt;
}

std::optional<Error> readUvSets(const AttributeReader& reader, const tinygltf::Primitive& source, std::size_t vertices,
                                Primitive& primitive, LoadReport& report) {
  for (const auto& [name, accessor] : source.attributes) {
    if (name.rfind("TEXCOORD_", 0) != 0) continue;
    const std::string digits = name.substr(9);
    const bool small = digits.size() == 1 && digits[0] >= '0' && digits[0] < '0' + kMaxUvSets;
    if (!small) {
      report.warnings.push_back(primitive.name + ": " + name + " is left out; at most " + std::to_string(kMaxUvSets) +
                                " UV sets are read");
      continue;
    }
    auto uvs = reader.read<Vec2>(name, vertices);
    if (!uvs) return uvs.error();
    const auto set = static_cast<std::size_t>(digits[0] - '0');
    if (primitive.uvSets.size() <= set) primitive.uvSets.resize(set + 1);
    primitive.uvSets[set] = *std::move(uvs);
  }
  return std::nullopt;
}

std::optional<Error> applySkin(const GltfDocument& document, const AttributeReader& reader, const std::string& place,
                               const std::vector<Mat4>& jointMatrices, Primitive& primitive) {
  const std::size_t vertices = primitive.positions.size();
  SkinBlend blend(vertices);
  for (const char* set : {"0", "1", "2", "3"}) {
    const std::string jointsName = std::string("JOINTS_") + set, weightsName = std::string("WEIGHTS_") + set;
    if (!reader.has(jointsName) || !reader.has(weightsName)) break;
    auto joints = reader.read<Vec4>(jointsName, vertices);
    if (!joints) return joints.error();
    auto weights = reader.read<Vec4>(weightsName, vertices);
    if (!weights) return weights.error();
    if (!blend.add(jointMatrices, *joints, *weights))
      return document.error(place + "/attributes/" + jointsName,
                            "refers to a joint beyond the skin's " + std::to_string(jointMatrices.size()));
  }
  blend.apply(primitive);
  return std::nullopt;
}

}  // namespace

Expected<std::vector<std::uint32_t>> readAttributes(const GltfDocument& document, const tinygltf::Primitive& source,
                                                    const std::string& place, const MeshUse& use, Primitive& primitive,
                                                    LoadReport& report) {
  AttributeReader reader(document, source, place);
  if (!reader.has("POSITION")) {
    report.warnings.push_back(primitive.name + ": has no POSITION; left out");
    return std::vector<std::uint32_t>{};
  }
  if (auto error = reader.openDraco()) return *error;
  const std::size_t vertices = reader.vertexCount();
  auto positions = reader.read<Vec3>("POSITION", vertices);
  if (!positions) return positions.error();
  primitive.positions = *std::move(positions);
  if (reader.has("NORMAL")) {
    auto normals = reader.read<Vec3>("NORMAL", vertices);
    if (!normals) return normals.error();
    primitive.normals = *std::move(normals);
    // glTF 2.0, section 3.7.2.1: without normals, tangents are to be ignored.
    if (reader.has("TANGENT")) {
      auto tangents = reader.read<Vec4>("TANGENT", vertices);
      if (!tangents) return tangents.error();
      primitive.tangents = *std::move(tangents);
    }
  }
  if (auto error = readUvSets(reader, source, vertices, primitive, report)) return *error;
  if (reader.has("COLOR_0"))
    if (auto error = readColors(reader, vertices, primitive)) return *error;
  if (auto error = applyMorphs(document, source, place, use, primitive)) return *error;
  if (!use.jointMatrices.empty())
    if (auto error = applySkin(document, reader, place, use.jointMatrices, primitive)) return *error;
  return reader.indices(vertices);
}

}  // namespace lumel
