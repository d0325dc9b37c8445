#include "scene/obj/obj_loader.h"

#include <cmath>
#include <map>
#include <unordered_map>

#include "scene/images/ssbump_maps.h"
#include "scene/obj/obj_material.h"
#include "scene/obj/obj_parser.h"
#include "scene/triangles/polygon.h"
#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

/// A corner's identity within a primitive: the same key, the same vertex.
struct VertexKey {
  int position;
  int texcoord;
  Vec3 normal;
  bool operator==(const VertexKey&) const = default;
};

struct VertexKeyHash {
  std::size_t operator()(const VertexKey& key) const {
    std::size_t hash = static_cast<std::size_t>(key.position) * 0x9E3779B97F4A7C15ull;
    hash = (hash ^ static_cast<std::size_t>(key.texcoord + 1)) * 0xD6E8FEB86659FD93ull;
    for (int c = 0; c < 3; ++c) hash = (hash ^ std::hash<float>()(key.normal[c])) * 0x9E3779B97F4A7C15ull;
    return hash ^ (hash >> 29);
  }
};

class ShapeBuilder {
 public:
  ShapeBuilder(const ObjFile& file, const ObjShape& shape, int defaultMaterial)
      : file_(file), shape_(shape), defaultMaterial_(defaultMaterial) {}

  Mesh run() {
    sumSmoothNormals();
    for (const ObjFace& face : shape_.faces) addFace(face);
    Mesh mesh;
    mesh.name = shape_.name.empty() ? "unnamed" : shape_.name;
    for (auto& [material, part] : parts_) mesh.primitives.push_back(std::move(part.primitive));
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p)
      mesh.primitives[p].name = "mesh '" + mesh.name + "' primitive " + std::to_string(p);
    return mesh;
  }

 private:
  struct Part {
    Primitive primitive;
    std::unordered_map<VertexKey, std::uint32_t, VertexKeyHash> vertices;
  };

  const ObjCorner& corner(const ObjFace& face, std::size_t k) const { return shape_.corners[face.firstCorner + k]; }
  Vec3 position(const ObjFace& face, std::size_t k) const {
    return file_.positions[static_cast<std::size_t>(corner(face, k).position)];
  }

  std::vector<Vec3> positionsOf(const ObjFace& face) const {
    std::vector<Vec3> positions;
    for (std::size_t k = 0; k < face.corners; ++k) positions.push_back(position(face, k));
    return positions;
  }

  /// Per smoothing group and vertex, the faces' normals weighted by area and the corner's angle.
  void sumSmoothNormals() {
    for (const ObjFace& face : shape_.faces) {
      if (face.smoothingGroup == 0) continue;
      const Vec3d area = newellNormal(positionsOf(face));
      for (std::size_t k = 0; k < face.corners; ++k) {
        const Vec3d p(position(face, k));
        const Vec3d a = Vec3d(position(face, (k + 1) % face.corners)) - p;
        const Vec3d b = Vec3d(position(face, (k + face.corners - 1) % face.corners)) - p;
        const double lengths = glm::length(a) * glm::length(b);
        if (!(lengths > 0)) continue;
        const double angle = std::acos(glm::clamp(glm::dot(a, b) / lengths, -1.0, 1.0));
        smooth_.try_emplace({face.smoothingGroup, corner(face, k).position}, 0).first->second += angle * area;
      }
    }
  }

  Vec3 normalOf(const ObjFace& face, std::size_t k, const Vec3& flat) const {
    const ObjCorner& c = corner(face, k);
    if (c.normal >= 0) return file_.normals[static_cast<std::size_t>(c.normal)] + 0.0f;
    if (face.smoothingGroup == 0) return flat;
    const auto it = smooth_.find({face.smoothingGroup, c.position});
    if (it == smooth_.end() || !(glm::length(it->second) > 0)) return flat;
    return Vec3(glm::normalize(it->second)) + 0.0f;
  }

  void addFace(const ObjFace& face) {
    const std::vector<Vec3> corners = positionsOf(face);
    const int material = face.material >= 0 ? face.material : defaultMaterial_;
    Part& part = parts_[material];
    part.primitive.material = material;
    for (const auto& triangle : triangulatePolygon(corners)) {
      const Vec3d a(corners[triangle[0]]);
      const Vec3d area = glm::cross(Vec3d(corners[triangle[1]]) - a, Vec3d(corners[triangle[2]]) - a);
      // A triangle without area is dropped later, whatever its normal.
      const Vec3 flat = glm::length(area) > 0 ? Vec3(glm::normalize(area)) + 0.0f : Vec3(0, 1, 0);
      for (const std::uint32_t k : triangle) part.primitive.indices.push_back(vertexFor(part, face, k, flat));
    }
  }

  std::uint32_t vertexFor(Part& part, const ObjFace& face, std::size_t k, const Vec3& flat) {
    const ObjCorner& c = corner(face, k);
    const VertexKey key{c.position, c.texcoord, normalOf(face, k, flat)};
    Primitive& primitive = part.primitive;
    const auto [it, isNew] = part.vertices.try_emplace(key, static_cast<std::uint32_t>(primitive.positions.size()));
    if (!isNew) return it->second;
    primitive.positions.push_back(file_.positions[static_cast<std::size_t>(c.position)]);
    primitive.normals.push_back(key.normal);
    if (c.texcoord >= 0 && primitive.uvSets.empty())
      primitive.uvSets.emplace_back(primitive.positions.size() - 1, Vec2(0));
    if (!primitive.uvSets.empty()) {
      const Vec2 uv = c.texcoord >= 0 ? file_.texcoords[static_cast<std::size_t>(c.texcoord)] : Vec2(0, 1);
      primitive.uvSets[0].emplace_back(uv.x, 1.0f - uv.y);
    }
    return it->second;
  }

  const ObjFile& file_;
  const ObjShape& shape_;
  const int defaultMaterial_;
  std::map<std::pair<unsigned, int>, Vec3d> smooth_;
  std::map<int, Part> parts_;  // by material
};

Expected<Scene> build(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                      const LoadOptions& options) {
  auto file = parseObj(text, name, folder, options);
  if (!file) return file.error();
  Scene scene;
  scene.report.warnings = file->warnings;
  scene.report.skippedPrimitives = file->linesAndPoints;
  if (auto loaded = loadObjMaterials(*file, name, folder, options, scene); !loaded) return loaded.error();
  if (auto assigned = assignSsbumpMaps(scene, options); !assigned) return assigned.error();
  for (const ObjShape& shape : file->shapes) {
    Mesh mesh = ShapeBuilder(*file, shape, static_cast<int>(scene.materials.size()) - 1).run();
    for (Primitive& primitive : mesh.primitives)
      finishPrimitive(primitive, scene.materials[static_cast<std::size_t>(primitive.material)], scene.report);
    std::erase_if(mesh.primitives, [](const Primitive& p) { return p.indices.empty(); });
    if (mesh.primitives.empty()) continue;
    Instance instance;
    instance.name = mesh.name;
    instance.mesh = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
    scene.instances.push_back(std::move(instance));
  }
  return scene;
}

}  // namespace

Expected<Scene> loadObj(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                        const LoadOptions& options) {
  try {
    return build(text, name, folder, options);
  } catch (const std::bad_alloc&) {
    return failure(name + ": not enough memory to load it");
  } catch (const std::exception& e) {
    return inputError(name + ": " + e.what());
  }
}

}  // namespace lumel
