// The texels of a low-poly mesh's UV charts as surface points, each with its tangent frame.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel::ssbump {

/// Triangles of all instances in world space, one entry per corner.
struct FlatMesh {
  std::vector<Vec3> positions, normals;
  std::vector<Vec4> tangents;  // xyz, w = +-1; empty where uvSet < 0
  std::vector<Vec2> uvs;       // empty where uvSet < 0
  Vec3 lowest{0}, highest{0};

  std::size_t triangles() const { return positions.size() / 3; }
  float diagonal() const { return glm::length(highest - lowest); }
};

/// uvSet < 0: positions and normals only. Tangents are the mesh's own, else from the UVs (scene/tangents.h): t along u,
/// b up the image. Errors: Input (no triangles, no such UV set, not finite).
Expected<FlatMesh> flatten(const Scene& scene, int uvSet, const std::string& what);

struct SurfaceTexel {
  bool covered = false;
  Vec3 p{0};
  Frame frame;
};

/// width * height texels, rows from the top; a texel is covered where its centre lies in a triangle's UVs.
std::vector<SurfaceTexel> rasterizeCharts(const FlatMesh& mesh, int width, int height);

}  // namespace lumel::ssbump
