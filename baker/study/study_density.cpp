#include "baker/study/study_density.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

std::uint64_t keyOf(const Surface& surface, std::uint32_t triangle) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(surface.primitive)) << 32) |
         surface.sourceTriangle[triangle];
}

Vec3 bilinear(const Image& image, Vec2 uv) {
  const float x = uv.x * static_cast<float>(image.width) - 0.5f;
  const float y = uv.y * static_cast<float>(image.height) - 0.5f;
  const float left = std::floor(x);
  const float top = std::floor(y);
  Vec3 sum(0.0f);
  for (int k = 0; k < 4; ++k) {
    const float dx = static_cast<float>(k & 1);
    const float dy = static_cast<float>(k >> 1);
    const float weight = (1.0f - std::abs(x - left - dx)) * (1.0f - std::abs(y - top - dy));
    sum += weight * image.rgb(std::clamp(static_cast<int>(left + dx), 0, image.width - 1),
                              std::clamp(static_cast<int>(top + dy), 0, image.height - 1));
  }
  return sum;
}

}  // namespace

AtlasLookup::AtlasLookup(const Atlas& atlas, const std::vector<BakedPage>& pages) : atlas_(atlas), pages_(pages) {
  for (std::uint32_t s = 0; s < atlas.surfaces.size(); ++s) {
    const Surface& surface = atlas.surfaces[s];
    const auto instance = static_cast<std::size_t>(surface.instance);
    if (triangles_.size() <= instance) triangles_.resize(instance + 1);
    for (std::uint32_t t = 0; t < surface.triangleCount(); ++t)
      triangles_[instance].emplace(keyOf(surface, t), TriangleRef{s, t});
  }
}

std::optional<Vec3> AtlasLookup::flatAt(const Atlas& other, const SurfacePoint& point) const {
  const Surface& from = other.surfaces[point.triangle.surface];
  const auto instance = static_cast<std::size_t>(from.instance);
  if (instance >= triangles_.size()) return {};
  const auto found = triangles_[instance].find(keyOf(from, point.triangle.triangle));
  if (found == triangles_[instance].end()) return {};
  const Surface& to = atlas_.surfaces[found->second.surface];
  Vec2 uv(0.0f);
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t corner = from.indices[std::size_t{3} * point.triangle.triangle + static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = to.indices[std::size_t{3} * found->second.triangle + static_cast<std::size_t>(k)];
      if (to.sourceVertex[vertex] != from.sourceVertex[corner]) continue;
      uv += point.barycentric[i] * to.lightmapUvs[vertex];
      break;
    }
  }
  return bilinear(pages_[static_cast<std::size_t>(to.page)].flat, uv);
}

}  // namespace lumel
