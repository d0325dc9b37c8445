#include "ssbump/mesh/low_poly.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/triangles/tangents.h"

namespace lumel::ssbump {
namespace {

/// False where a position or UV is not finite.
bool append(FlatMesh& mesh, const Primitive& primitive, const Mat4& world, int uvSet, bool& hasTangents) {
  const Mat3 linear(world);
  const bool mirrored = glm::determinant(linear) < 0;
  const Mat3 normalMatrix = glm::transpose(glm::inverse(linear));
  for (std::size_t f = 0; f < primitive.triangleCount(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      // A mirroring transform turns triangles inside out: their corners go the other way round.
      const std::uint32_t v = primitive.indices[f * 3 + (mirrored && k ? 3 - k : k)];
      const Vec3 p = Vec3(world * Vec4(primitive.positions[v], 1));
      if (!isFinite(p)) return false;
      mesh.positions.push_back(p);
      mesh.normals.push_back(glm::normalize(normalMatrix * primitive.normals[v]));
      if (uvSet < 0) continue;
      const Vec2 uv = primitive.uvSets[static_cast<std::size_t>(uvSet)][v];
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return false;
      mesh.uvs.push_back(uv);
      if (primitive.tangents.empty()) {
        hasTangents = false;
        mesh.tangents.emplace_back(0);
      } else {
        const Vec4 t = primitive.tangents[v];
        mesh.tangents.emplace_back(linear * Vec3(t), mirrored ? -t.w : t.w);
      }
    }
  return true;
}

}  // namespace

Expected<FlatMesh> flatten(const Scene& scene, int uvSet, const std::string& what) {
  FlatMesh mesh;
  bool hasTangents = true;
  for (const Instance& instance : scene.instances)
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      if (uvSet >= static_cast<int>(primitive.uvSets.size()))
        return inputError(what + ": " + primitive.name + " has no UV set " + std::to_string(uvSet) +
                          "; unwrap it or choose another with --uv-set");
      if (!append(mesh, primitive, instance.worldFromObject, uvSet, hasTangents))
        return inputError(what + ": " + primitive.name + ": a position or UV is not finite; repair the mesh");
    }
  if (mesh.positions.empty()) return inputError(what + ": holds no triangles");
  mesh.lowest = mesh.highest = mesh.positions[0];
  for (const Vec3& p : mesh.positions) {
    mesh.lowest = glm::min(mesh.lowest, p);
    mesh.highest = glm::max(mesh.highest, p);
  }
  if (uvSet >= 0 && !hasTangents) {
    std::vector<std::uint32_t> corners(mesh.positions.size());
    std::iota(corners.begin(), corners.end(), 0u);
    mesh.tangents = cornerTangents(mesh.positions, mesh.normals, mesh.uvs, corners);
  }
  return mesh;
}

std::vector<SurfaceTexel> rasterizeCharts(const FlatMesh& mesh, int width, int height) {
  std::vector<SurfaceTexel> texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Vec2 size(static_cast<float>(width), static_cast<float>(height));
  for (std::size_t f = 0; f < mesh.triangles(); ++f) {
    const std::size_t c = f * 3;
    const Vec2 a = mesh.uvs[c] * size, b = mesh.uvs[c + 1] * size, d = mesh.uvs[c + 2] * size;
    const float det = (b.x - a.x) * (d.y - a.y) - (d.x - a.x) * (b.y - a.y);
    if (std::abs(det) < 1e-12f) continue;
    const Vec2 lo = glm::clamp(glm::floor(glm::min(a, glm::min(b, d))), Vec2(0), size - 1.0f);
    const Vec2 hi = glm::clamp(glm::ceil(glm::max(a, glm::max(b, d))), Vec2(0), size - 1.0f);
    for (int y = static_cast<int>(lo.y); y <= static_cast<int>(hi.y); ++y)
      for (int x = static_cast<int>(lo.x); x <= static_cast<int>(hi.x); ++x) {
        const Vec2 p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        const float wb = ((p.x - a.x) * (d.y - a.y) - (d.x - a.x) * (p.y - a.y)) / det;
        const float wd = ((b.x - a.x) * (p.y - a.y) - (p.x - a.x) * (b.y - a.y)) / det;
        const float wa = 1 - wb - wd;
        // Centres on a shared edge belong to the first triangle that claims them.
        SurfaceTexel& texel =
            texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
        if (texel.covered || wa < -1e-6f || wb < -1e-6f || wd < -1e-6f) continue;
        texel.covered = true;
        texel.p = wa * mesh.positions[c] + wb * mesh.positions[c + 1] + wd * mesh.positions[c + 2];
        const Vec3 n = glm::normalize(wa * mesh.normals[c] + wb * mesh.normals[c + 1] + wd * mesh.normals[c + 2]);
        const Vec3 t = wa * Vec3(mesh.tangents[c]) + wb * Vec3(mesh.tangents[c + 1]) + wd * Vec3(mesh.tangents[c + 2]);
        texel.frame = frameFromTangent(n, Vec4(t, mesh.tangents[c].w));
      }
  }
  return texels;
}

}  // namespace lumel::ssbump
