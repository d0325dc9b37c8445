#include "baker/texel_cache.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "scene/check.h"
#include "scene/parallel.h"

namespace lumel {

TexelMap::TexelMap(const RayScene& rays, const Atlas& atlas, const std::vector<PageTexels>& texels)
    : atlas_(atlas), texels_(texels) {
  firstOfPage_.push_back(0);
  std::size_t count = 0;
  std::size_t pixels = 0;
  for (const PageTexels& page : texels) {
    count += page.size();
    LUMEL_CHECK(count < kNoTexel);
    firstOfPage_.push_back(static_cast<std::uint32_t>(count));
    pages_.push_back({page.width, page.height, pixels});
    pixels += static_cast<std::size_t>(page.width) * static_cast<std::size_t>(page.height);
  }
  pixels_.assign(pixels, kNoTexel);
  for (std::size_t p = 0; p < texels.size(); ++p)
    for (std::size_t i = 0; i < texels[p].size(); ++i) {
      const TexelCoord at = texels[p].coords[i];
      pixels_[pages_[p].first + std::size_t{at.y} * static_cast<std::size_t>(pages_[p].width) + at.x] =
          firstOfPage_[p] + static_cast<std::uint32_t>(i);
    }

  firstOfPart_.assign(rays.parts().size(), -1);
  // Instances and primitives number surfaces; parts leave out what rays cannot hit.
  std::map<std::pair<int, const Primitive*>, std::uint32_t> partOf;
  for (std::uint32_t p = 0; p < rays.parts().size(); ++p)
    partOf.emplace(std::pair(rays.parts()[p].instance, rays.parts()[p].primitive), p);
  for (const Surface& surface : atlas.surfaces)
    if (const auto found = partOf.find({surface.instance, rays.primitiveOf(surface.instance, surface.primitive)});
        found != partOf.end())
      addSurface(rays, found->second, surface);
}

void TexelMap::addSurface(const RayScene& rays, std::uint32_t part, const Surface& surface) {
  const ScenePart& source = rays.parts()[part];
  if (firstOfPart_[part] < 0) {
    firstOfPart_[part] = static_cast<std::int64_t>(triangles_.size());
    triangles_.resize(triangles_.size() + source.primitive->triangleCount());
  }
  const PageMap& page = pages_[static_cast<std::size_t>(surface.page)];
  for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
    const std::uint32_t sourceTriangle = surface.sourceTriangle[t];
    Triangle& triangle = triangles_[static_cast<std::size_t>(firstOfPart_[part]) + sourceTriangle];
    const std::uint32_t* sourceCorner = source.primitive->indices.data() + std::size_t{3} * sourceTriangle;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = surface.indices[3 * t + k];
        if (surface.sourceVertex[vertex] == sourceCorner[i])
          triangle.pixels[i] = surface.lightmapUvs[vertex] * Vec2(page.width, page.height);
      }
    const std::array<Vec3, 3> corner = rays.corners(source, sourceTriangle);
    triangle.frontNormal = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0])) * source.frontSign;
    triangle.page = static_cast<std::uint32_t>(surface.page);
  }
}

std::size_t TexelMap::pageOf(std::uint32_t texel) const {
  return static_cast<std::size_t>(std::upper_bound(firstOfPage_.begin(), firstOfPage_.end(), texel) -
                                  firstOfPage_.begin()) -
         1;
}

std::uint32_t TexelMap::at(const PageMap& page, int x, int y) const {
  if (x < 0 || y < 0 || x >= page.width || y >= page.height) return kNoTexel;
  return pixels_[page.first + static_cast<std::size_t>(y) * static_cast<std::size_t>(page.width) +
                 static_cast<std::size_t>(x)];
}

std::uint32_t TexelMap::find(std::uint32_t part, std::uint32_t triangleIndex, Vec2 barycentric,
                             const Vec3& dirWorld) const {
  const std::int64_t first = firstOfPart_[part];
  if (first < 0) return kNoTexel;
  const Triangle& triangle = triangles_[static_cast<std::size_t>(first) + triangleIndex];
  if (triangle.page == kNoTexel || glm::dot(dirWorld, triangle.frontNormal) > 0.0f) return kNoTexel;
  const PageMap& page = pages_[triangle.page];
  const Vec2 pixel = (1.0f - barycentric.x - barycentric.y) * triangle.pixels[0] + barycentric.x * triangle.pixels[1] +
                     barycentric.y * triangle.pixels[2];
  const int x = static_cast<int>(std::floor(pixel.x));
  const int y = static_cast<int>(std::floor(pixel.y));
  if (const std::uint32_t texel = at(page, x, y); texel != kNoTexel) return texel;
  // A point on a chart's border may round to the texel beside it.
  const int sideX = pixel.x - static_cast<float>(x) < 0.5f ? -1 : 1;
  const int sideY = pixel.y - static_cast<float>(y) < 0.5f ? -1 : 1;
  for (const auto& [dx, dy] : {std::pair(sideX, 0), std::pair(0, sideY), std::pair(sideX, sideY)})
    if (const std::uint32_t texel = at(page, x + dx, y + dy); texel != kNoTexel) return texel;
  return kNoTexel;
}

std::uint32_t TexelMap::chartOf(const PageTexels& page, std::size_t texel) const {
  const TriangleRef& ref = page.triangles[page.firstTriangle[texel]];
  return atlas_.surfaces[ref.surface].charts[ref.triangle];
}

std::uint32_t TexelMap::nearestValid(std::size_t pageIndex, std::size_t texel,
                                     std::span<const std::uint8_t> valid) const {
  const PageTexels& page = texels_[pageIndex];
  const TexelCoord at = page.coords[texel];
  const std::uint32_t chart = chartOf(page, texel);
  std::uint32_t best = kNoTexel;
  int leastDistance2 = std::numeric_limits<int>::max();
  // Nothing on a later ring is nearer than what was found within its radius.
  for (int ring = 1; ring <= kReach && ring * ring < leastDistance2; ++ring)
    for (int dy = -ring; dy <= ring; ++dy) {
      const int step = std::abs(dy) == ring ? 1 : 2 * ring;
      for (int dx = -ring; dx <= ring; dx += step) {
        const int distance2 = dx * dx + dy * dy;
        if (distance2 >= leastDistance2) continue;
        const std::uint32_t found = this->at(pages_[pageIndex], at.x + dx, at.y + dy);
        if (found == kNoTexel || !valid[found] || chartOf(page, found - firstOfPage_[pageIndex]) != chart) continue;
        best = found;
        leastDistance2 = distance2;
      }
    }
  return best;
}

std::vector<TexelMap::Substitute> TexelMap::substitutes(std::span<const std::uint8_t> valid) const {
  std::vector<Substitute> all;
  for (std::uint32_t t = 0; t < valid.size(); ++t)
    if (!valid[t]) all.push_back({t, kNoTexel});
  parallelFor(all.size(), 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t page = pageOf(all[i].texel);
      all[i].source = nearestValid(page, all[i].texel - firstOfPage_[page], valid);
    }
  });
  std::erase_if(all, [](const Substitute& s) { return s.source == kNoTexel; });
  return all;
}

}  // namespace lumel
