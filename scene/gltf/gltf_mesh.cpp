#include "scene/gltf/gltf_mesh.h"

#include <algorithm>
#include <exception>
#include <optional>

#include "scene/base/parallel.h"
#include "scene/gltf/gltf_attributes.h"
#include "scene/gltf/gltf_extras.h"
#include "scene/gltf/gltf_skin.h"
#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

struct Job {
  std::size_t use = 0;
  std::size_t primitive = 0;
  std::optional<Error> error;
  Primitive result;
  LoadReport report;
};

/// Triangles of a list, strip or fan (glTF 2.0, section 3.7.2.1). Extra indices at a list's end are left out.
std::vector<std::uint32_t> triangulate(const std::vector<std::uint32_t>& in, int mode) {
  std::vector<std::uint32_t> out;
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    out.assign(in.begin(), in.begin() + static_cast<std::ptrdiff_t>(in.size() / 3 * 3));
    return out;
  }
  if (in.size() < 3) return out;
  out.reserve(3 * (in.size() - 2));
  for (std::size_t i = 0; i + 2 < in.size(); ++i) {
    if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      const std::size_t odd = i % 2;
      out.insert(out.end(), {in[i], in[i + 1 + odd], in[i + 2 - odd]});
    } else {
      out.insert(out.end(), {in[i + 1], in[i + 2], in[0]});
    }
  }
  return out;
}

std::optional<Error> checkPositions(const GltfDocument& document, const std::string& place,
                                    const Primitive& primitive) {
  for (std::size_t v = 0; v < primitive.positions.size(); ++v) {
    const Vec3& p = primitive.positions[v];
    if (!isFinite(p))
      return document.error(place + "/attributes/POSITION",
                            "vertex " + std::to_string(v) + " is not finite; repair the mesh and export again");
    if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kMaxCoordinate)
      return document.error(
          place + "/attributes/POSITION",
          "vertex " + std::to_string(v) + " is more than 1e18 m away; repair the mesh and export again");
  }
  return std::nullopt;
}

std::optional<Error> load(const GltfDocument& document, const MeshUse& use, const Scene& scene, Job& job) {
  const auto& mesh = document.model.meshes[static_cast<std::size_t>(use.mesh)];
  const auto& source = mesh.primitives[job.primitive];
  const std::string place = "meshes/" + std::to_string(use.mesh) + "/primitives/" + std::to_string(job.primitive);
  Primitive& primitive = job.result;
  primitive.name = "mesh '" + (mesh.name.empty() ? std::to_string(use.mesh) : mesh.name) + "' primitive " +
                   std::to_string(job.primitive);
  primitive.material = source.material >= 0 ? source.material : static_cast<int>(scene.materials.size()) - 1;
  primitive.lightmapPage = readLightmapPage(source.extras);
  if (source.mode < TINYGLTF_MODE_TRIANGLES) {
    job.report.skippedPrimitives = 1;
    return std::nullopt;
  }
  auto indices = readAttributes(document, source, place, use, primitive, job.report);
  if (!indices) return indices.error();
  if (auto error = checkPositions(document, place, primitive)) return error;
  if (use.vertexTransform)
    for (std::size_t v = 0; v < primitive.positions.size(); ++v) transformVertex(primitive, v, *use.vertexTransform);
  // Draco hands over a triangle list whatever the mode.
  const bool isList =
      source.mode == TINYGLTF_MODE_TRIANGLES || findExtension(source.extensions, "KHR_draco_mesh_compression");
  primitive.indices = triangulate(*indices, isList ? TINYGLTF_MODE_TRIANGLES : source.mode);
  if (isList && indices->size() % 3 != 0)
    job.report.warnings.push_back(primitive.name + ": " + std::to_string(indices->size()) +
                                  " indices are not whole triangles; the last are left out");
  finishPrimitive(primitive, scene.materials[static_cast<std::size_t>(primitive.material)], job.report);
  return std::nullopt;
}

}  // namespace

Expected<void> loadMeshes(const GltfDocument& document, const std::vector<MeshUse>& uses, Scene& scene) {
  std::vector<Job> jobs;
  for (std::size_t u = 0; u < uses.size(); ++u) {
    const auto& mesh = document.model.meshes[static_cast<std::size_t>(uses[u].mesh)];
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
      jobs.emplace_back();
      jobs.back().use = u;
      jobs.back().primitive = p;
    }
  }
  parallelFor(jobs.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t j = first; j < last; ++j) {
      try {
        jobs[j].error = load(document, uses[jobs[j].use], scene, jobs[j]);
      } catch (const std::exception& e) {
        jobs[j].error = failure(document.name + ": meshes/" + std::to_string(uses[jobs[j].use].mesh) + ": " + e.what());
      }
    }
  });
  const std::size_t base = scene.meshes.size();
  for (const MeshUse& use : uses) {
    const auto& name = document.model.meshes[static_cast<std::size_t>(use.mesh)].name;
    scene.meshes.push_back({name.empty() ? "mesh " + std::to_string(use.mesh) : name, {}});
  }
  for (Job& job : jobs) {
    if (job.error) return *job.error;
    scene.report.degenerateTriangles += job.report.degenerateTriangles;
    scene.report.skippedPrimitives += job.report.skippedPrimitives;
    for (auto& warning : job.report.warnings) scene.report.warnings.push_back(std::move(warning));
    if (!job.result.indices.empty()) scene.meshes[base + job.use].primitives.push_back(std::move(job.result));
  }
  return {};
}

}  // namespace lumel
