#include "scene/gltf/gltf_nodes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "scene/gltf/gltf_accessor.h"
#include "scene/gltf/gltf_extras.h"
#include "scene/gltf/gltf_lights.h"
#include "scene/gltf/gltf_skin.h"

namespace lumel {
namespace {

constexpr std::size_t kMaxInstances = 50'000'000;

std::string placeOf(std::size_t node) { return "nodes/" + std::to_string(node); }

glm::dmat4 trs(const glm::dvec3& translation, const glm::dquat& rotation, const glm::dvec3& scale) {
  const double length = glm::length(rotation);
  const glm::dmat3 r = length > 0 ? glm::mat3_cast(rotation / length) : glm::dmat3(1.0);
  return {glm::dvec4(r[0] * scale.x, 0), glm::dvec4(r[1] * scale.y, 0), glm::dvec4(r[2] * scale.z, 0),
          glm::dvec4(translation, 1)};
}

glm::dmat4 parentFromNode(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) {
    glm::dmat4 m;
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return m;
  }
  const auto vec = [](const std::vector<double>& v, double fallback) {
    return v.size() == 3 ? glm::dvec3(v[0], v[1], v[2]) : glm::dvec3(fallback);
  };
  const auto& q = node.rotation;
  const glm::dquat rotation = q.size() == 4 ? glm::dquat(q[3], q[0], q[1], q[2]) : glm::dquat(1, 0, 0, 0);
  return trs(vec(node.translation, 0), rotation, vec(node.scale, 1));
}

bool isUsable(const glm::dmat4& m) {
  for (int i = 0; i < 16; ++i)
    if (!(std::abs(m[i / 4][i % 4]) <= double{kMaxCoordinate})) return false;
  return true;
}

/// Whether the matrix, rounded to floats, has an inverse worth the name: its axes span more than a sheet.
bool isInvertible(const glm::dmat4& m) {
  const glm::dvec3 x(m[0]), y(m[1]), z(m[2]);
  const double volume = std::abs(glm::dot(x, glm::cross(y, z)));
  return volume > 1e-12 * glm::length(x) * glm::length(y) * glm::length(z);
}

class NodeFlattener {
 public:
  NodeFlattener(const GltfDocument& document, Scene& scene)
      : document_(document), nodes_(document.model.nodes), scene_(scene) {}

  Expected<std::vector<MeshUse>> run();

 private:
  std::optional<Error> placeNodes();
  std::vector<int> sceneRoots() const;
  std::optional<Error> visit(std::size_t node);
  std::optional<Error> addMesh(std::size_t node);
  Expected<std::vector<glm::dmat4>> instanceTransforms(std::size_t node) const;
  void addInstance(const tinygltf::Node& node, const std::string& name, const glm::dmat4& world,
                   const ObjectSettings& settings);
  int addUse(MeshUse use);
  int plainUse(int mesh);
  void warnOfAreaLights();
  void addCamera(std::size_t node);
  std::optional<Error> addVolume(std::size_t index);

  const GltfDocument& document_;
  const std::vector<tinygltf::Node>& nodes_;
  Scene& scene_;
  std::vector<int> parents_;
  std::vector<glm::dmat4> worldFromNode_;
  std::vector<MeshUse> uses_;
  std::map<int, int> plainUses_;  // mesh of the file -> use
  LightScale lightScale_;
  std::vector<std::string> areaLights_;  // names of nodes that look like them
};

/// World transforms of all nodes, parents before children; what no root leads to is in a cycle.
std::optional<Error> NodeFlattener::placeNodes() {
  parents_.assign(nodes_.size(), -1);
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    for (std::size_t c = 0; c < nodes_[n].children.size(); ++c) {
      int& parent = parents_[static_cast<std::size_t>(nodes_[n].children[c])];
      if (parent >= 0)
        return document_.error(placeOf(n) + "/children/" + std::to_string(c),
                               "node " + std::to_string(nodes_[n].children[c]) + " is already a child of node " +
                                   std::to_string(parent) + "; a node has one parent");
      parent = static_cast<int>(n);
    }
  worldFromNode_.assign(nodes_.size(), glm::dmat4(1.0));
  std::vector<bool> placed(nodes_.size(), false);
  std::vector<std::size_t> pending;
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    if (parents_[n] < 0) pending.push_back(n);
  while (!pending.empty()) {
    const std::size_t n = pending.back();
    pending.pop_back();
    const glm::dmat4 local = parentFromNode(nodes_[n]);
    worldFromNode_[n] = parents_[n] < 0 ? local : worldFromNode_[static_cast<std::size_t>(parents_[n])] * local;
    if (!isUsable(worldFromNode_[n]))
      return document_.error(placeOf(n), "its transform reaches beyond 1e18 m; correct it and export again");
    placed[n] = true;
    for (const int child : nodes_[n].children) pending.push_back(static_cast<std::size_t>(child));
  }
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    if (!placed[n]) return document_.error(placeOf(n), "is its own ancestor; correct the node tree");
  return std::nullopt;
}

std::vector<int> NodeFlattener::sceneRoots() const {
  const auto& scenes = document_.model.scenes;
  if (!scenes.empty()) return scenes[static_cast<std::size_t>(std::max(document_.model.defaultScene, 0))].nodes;
  std::vector<int> roots;
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    if (parents_[n] < 0) roots.push_back(static_cast<int>(n));
  return roots;
}

Expected<std::vector<glm::dmat4>> NodeFlattener::instanceTransforms(std::size_t node) const {
  const glm::dmat4& world = worldFromNode_[node];
  const auto* extension = findExtension(nodes_[node].extensions, "EXT_mesh_gpu_instancing");
  if (!extension || !extension->Has("attributes")) return std::vector<glm::dmat4>{world};
  const auto& attributes = extension->Get("attributes");
  const auto accessorOf = [&](const char* name) { return static_cast<int>(valueNumber(attributes, name, -1)); };
  std::vector<Vec3> translations, scales;
  std::vector<Vec4> rotations;
  std::size_t count = 0;
  bool first = true, agree = true;
  const auto note = [&](std::size_t size) {
    agree = agree && (first || size == count);
    count = size;
    first = false;
  };
  const auto read = [&](const char* name, auto& values) -> std::optional<Error> {
    if (accessorOf(name) < 0) return std::nullopt;
    auto array = readArray<typename std::decay_t<decltype(values)>::value_type>(document_, accessorOf(name));
    if (!array) return array.error();
    values = *std::move(array);
    note(values.size());
    return std::nullopt;
  };
  const std::string place = placeOf(node) + "/extensions/EXT_mesh_gpu_instancing";
  if (auto error = read("TRANSLATION", translations)) return *error;
  if (auto error = read("ROTATION", rotations)) return *error;
  if (auto error = read("SCALE", scales)) return *error;
  if (first) return std::vector<glm::dmat4>{world};
  if (!agree) return document_.error(place, "its attributes differ in length; export again");
  std::vector<glm::dmat4> transforms;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 t = translations.empty() ? glm::dvec3(0) : glm::dvec3(translations[i]);
    const glm::dvec3 s = scales.empty() ? glm::dvec3(1) : glm::dvec3(scales[i]);
    const Vec4 q = rotations.empty() ? Vec4(0, 0, 0, 1) : rotations[i];
    transforms.push_back(world * trs(t, glm::dquat(q.w, q.x, q.y, q.z), s));
    if (!isUsable(transforms.back()))
      return document_.error(place, "instance " + std::to_string(i) + " is not finite or beyond 1e18 m");
  }
  return transforms;
}

int NodeFlattener::addUse(MeshUse use) {
  uses_.push_back(std::move(use));
  return static_cast<int>(uses_.size()) - 1;
}

int NodeFlattener::plainUse(int mesh) {
  const auto [it, isNew] = plainUses_.try_emplace(mesh, 0);
  if (isNew) it->second = addUse({.mesh = mesh});
  return it->second;
}

void NodeFlattener::addInstance(const tinygltf::Node& node, const std::string& name, const glm::dmat4& world,
                                const ObjectSettings& settings) {
  const int mesh = node.mesh;
  const std::vector<double>& weights = node.weights;
  Instance instance;
  instance.lightmap = readLightmapPlace(node.extras);
  instance.name = name;
  instance.settings = settings;
  if (isInvertible(world)) {
    instance.worldFromObject = Mat4(world);
    instance.mesh = weights.empty() ? plainUse(mesh) : addUse({.mesh = mesh, .weights = weights});
  } else {
    instance.mesh = addUse({.mesh = mesh, .weights = weights, .vertexTransform = Mat4(world)});
  }
  scene_.instances.push_back(std::move(instance));
}

std::optional<Error> NodeFlattener::addMesh(std::size_t index) {
  const auto& node = nodes_[index];
  const auto& mesh = document_.model.meshes[static_cast<std::size_t>(node.mesh)];
  ObjectSettings settings;
  if (auto problem = readObjectSettings(mesh.extras, settings))
    return document_.error("meshes/" + std::to_string(node.mesh) + "/extras/lumel", *problem);
  if (auto problem = readObjectSettings(node.extras, settings))
    return document_.error(placeOf(index) + "/extras/lumel", *problem);
  const std::string name = !node.name.empty()   ? node.name
                           : !mesh.name.empty() ? mesh.name
                                                : "node " + std::to_string(index);

  if (node.skin >= 0) {
    auto joints = jointMatrices(document_, node.skin, worldFromNode_);
    if (!joints) return joints.error();
    Instance instance;  // joints alone place a skinned mesh: its node's transform does not count
    instance.name = name;
    instance.settings = settings;
    instance.mesh = addUse({.mesh = node.mesh, .weights = node.weights, .jointMatrices = *std::move(joints)});
    scene_.instances.push_back(std::move(instance));
    return std::nullopt;
  }
  auto transforms = instanceTransforms(index);
  if (!transforms) return transforms.error();
  if (transforms->size() > kMaxInstances - scene_.instances.size())
    return document_.error(placeOf(index), "the scene has more than " + std::to_string(kMaxInstances) + " instances");
  const bool many = findExtension(node.extensions, "EXT_mesh_gpu_instancing") != nullptr;
  for (std::size_t i = 0; i < transforms->size(); ++i)
    addInstance(node, many ? name + "[" + std::to_string(i) + "]" : name, (*transforms)[i], settings);
  return std::nullopt;
}

/// Says which nodes stand where a modelling tool had area lights.
void NodeFlattener::warnOfAreaLights() {
  constexpr std::size_t kMostNames = 6;
  if (areaLights_.empty()) return;
  std::string names;
  for (std::size_t i = 0; i < std::min(areaLights_.size(), kMostNames); ++i)
    names += (i == 0 ? "'" : ", '") + areaLights_[i] + "'";
  if (areaLights_.size() > kMostNames) names += " and " + std::to_string(areaLights_.size() - kMostNames) + " more";
  scene_.report.warnings.push_back(
      document_.name + ": empty nodes that look like area lights give no light, because glTF has none: " + names +
      "; give them extras.lumel.light (in Blender a custom property lumel), such as {\"light\": {\"type\": "
      "\"rectangle\", \"size\": [1, 1], \"watts\": 100}}");
}

void NodeFlattener::addCamera(std::size_t node) {
  const auto& source = document_.model.cameras[static_cast<std::size_t>(nodes_[node].camera)];
  Camera camera;
  camera.name = !source.name.empty() ? source.name : nodes_[node].name;
  // A camera's view does not scale with its node.
  const glm::dmat4& world = worldFromNode_[node];
  const glm::dvec3 x(world[0]), z(world[2]);
  if (!isInvertible(world)) {
    scene_.report.warnings.push_back(document_.name + ": " + placeOf(node) +
                                     ": the camera's transform has no inverse; left out");
    return;
  }
  const glm::dvec3 back = glm::normalize(z);
  const glm::dvec3 right = glm::normalize(x - back * glm::dot(x, back));
  const double side = glm::determinant(glm::dmat3(world)) < 0 ? -1.0 : 1.0;
  camera.worldFromCamera = Mat4(
      glm::dmat4(glm::dvec4(right, 0), glm::dvec4(side * glm::cross(back, right), 0), glm::dvec4(back, 0), world[3]));
  camera.orthographic = source.type == "orthographic";
  if (camera.orthographic) {
    camera.yExtent = static_cast<float>(source.orthographic.ymag);
    if (source.orthographic.ymag != 0)
      camera.aspect = static_cast<float>(std::abs(source.orthographic.xmag / source.orthographic.ymag));
  } else {
    camera.yFov = static_cast<float>(source.perspective.yfov);
    camera.aspect = static_cast<float>(source.perspective.aspectRatio);
  }
  scene_.cameras.push_back(std::move(camera));
}

/// The box lies around the node's origin, along the world's axes if the node is not turned, else around the turned one.
std::optional<Error> NodeFlattener::addVolume(std::size_t index) {
  std::optional<VolumeSettings> settings;
  if (auto problem = readVolumeSettings(nodes_[index].extras, settings))
    return document_.error(placeOf(index) + "/extras/lumel/volume", *problem);
  if (!settings) return std::nullopt;
  const glm::dmat4& world = worldFromNode_[index];
  VolumeBox box{.name = nodes_[index].name.empty() ? placeOf(index) : nodes_[index].name, .cell = settings->cell};
  Vec3d half(0.0);
  for (int axis = 0; axis < 3; ++axis) half += glm::abs(Vec3d(world[axis])) * (0.5 * settings->size[axis]);
  box.least = Vec3(Vec3d(world[3]) - half);
  box.most = Vec3(Vec3d(world[3]) + half);
  scene_.volumes.push_back(std::move(box));
  return std::nullopt;
}

std::optional<Error> NodeFlattener::visit(std::size_t index) {
  const auto& node = nodes_[index];
  if (node.mesh >= 0)
    if (auto error = addMesh(index)) return error;
  if (node.camera >= 0) addCamera(index);
  if (auto error = addLight(document_, index, worldFromNode_[index], lightScale_, scene_)) return error;
  if (auto error = addVolume(index)) return error;
  if (looksLikeAreaLight(node)) areaLights_.push_back(node.name.empty() ? placeOf(index) : node.name);
  return std::nullopt;
}

Expected<std::vector<MeshUse>> NodeFlattener::run() {
  if (auto error = placeNodes()) return *error;
  lightScale_ = lightScaleOf(document_, scene_.report.notes);
  std::vector<bool> visited(nodes_.size(), false);
  std::vector<std::size_t> pending;
  const auto push = [&](const std::vector<int>& list) {
    for (auto it = list.rbegin(); it != list.rend(); ++it) pending.push_back(static_cast<std::size_t>(*it));
  };
  push(sceneRoots());
  while (!pending.empty()) {
    const std::size_t n = pending.back();
    pending.pop_back();
    if (visited[n]) continue;  // listed twice by the scene
    visited[n] = true;
    if (auto error = visit(n)) return *error;
    push(nodes_[n].children);
  }
  warnOfAreaLights();
  return std::move(uses_);
}

}  // namespace

Expected<std::vector<MeshUse>> flattenNodes(const GltfDocument& document, Scene& scene) {
  return NodeFlattener(document, scene).run();
}

}  // namespace lumel
