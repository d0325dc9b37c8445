#include "lightmap/seams/border_edges.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr std::size_t kMostInCell = 2000;

struct Side {
  std::uint64_t vertices;  // the smaller first
  std::uint32_t index;     // three times the triangle, plus the corner
};

std::uint64_t keyOf(std::uint32_t a, std::uint32_t b) { return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b); }

/// The sides of triangles that no other triangle of the surface has, in order.
std::vector<std::uint32_t> openSides(const Surface& surface) {
  std::vector<Side> sides;
  sides.reserve(surface.indices.size());
  for (std::uint32_t i = 0; i < surface.indices.size(); ++i)
    sides.push_back({keyOf(surface.indices[i], surface.indices[i % 3 == 2 ? i - 2 : i + 1]), i});
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.vertices < b.vertices; });
  std::vector<std::uint32_t> open;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].vertices == sides[i].vertices) ++end;
    if (end == i + 1) open.push_back(sides[i].index);
    i = end;
  }
  std::sort(open.begin(), open.end());
  return open;
}

std::optional<BorderEdge> edgeOf(const Atlas& atlas, std::uint32_t surfaceIndex, std::uint32_t side) {
  const Surface& surface = atlas.surfaces[surfaceIndex];
  const Page& page = atlas.pages[static_cast<std::size_t>(surface.page)];
  BorderEdge edge;
  edge.surface = surfaceIndex;
  edge.triangle = side / 3;
  edge.corner = side % 3;
  edge.chart = surface.charts[edge.triangle];
  std::array<Vec3d, 3> p;
  std::array<Vec2d, 3> t;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = surface.indices[std::size_t{3} * edge.triangle + (edge.corner + k) % 3];
    p[k] = Vec3d(surface.positions[v]);
    t[k] = Vec2d(surface.lightmapUvs[v]) * Vec2d(page.width, page.height);
  }
  edge.start = p[0];
  edge.end = p[1];
  edge.length = glm::length(p[1] - p[0]);
  const Vec3d normal = glm::cross(p[1] - p[0], p[2] - p[0]);
  const double twiceArea = glm::length(normal);
  if (!(edge.length > 0.0) || !(twiceArea > 0.0) || !std::isfinite(twiceArea)) return std::nullopt;
  edge.direction = (p[1] - p[0]) / edge.length;
  edge.normal = normal / twiceArea;
  edge.outwards = glm::cross(edge.direction, edge.normal);
  edge.startTexel = t[0];
  edge.perMetre[0] = (t[1] - t[0]) / edge.length;
  const Vec3d third = p[2] - p[0];
  const double depth = glm::dot(third, edge.outwards);  // below zero
  edge.perMetre[1] = (t[2] - t[0] - edge.perMetre[0] * glm::dot(third, edge.direction)) / depth;
  const double area = std::abs(edge.perMetre[0].x * edge.perMetre[1].y - edge.perMetre[0].y * edge.perMetre[1].x);
  const double most = std::max(glm::length(edge.perMetre[0]), glm::length(edge.perMetre[1]));
  if (!(area > 0.0) || !std::isfinite(most)) return std::nullopt;
  edge.metresPerTexel = most / area;
  return edge;
}

/// A cell of a grid in space, as a number to sort by. Cells far apart may share one, which costs time alone.
std::uint64_t cellOf(const std::array<std::int64_t, 3>& cell) {
  const auto mix = [](std::int64_t i, std::uint64_t prime) { return static_cast<std::uint64_t>(i) * prime; };
  return mix(cell[0], 0x9E3779B97F4A7C15ull) ^ mix(cell[1], 0xC2B2AE3D27D4EB4Full) ^
         mix(cell[2], 0x165667B19E3779F9ull);
}

struct CellEntry {
  std::uint64_t cell;
  std::uint32_t edge;
  bool operator<(const CellEntry& other) const { return cell != other.cell ? cell < other.cell : edge < other.edge; }
  bool operator==(const CellEntry&) const = default;
};

/// Enters an edge into all cells that it passes or comes near: those that boxes around steps of half a cell touch,
/// which reach a quarter of a cell and a tenth of a texel to each side.
void enter(const BorderEdge& edge, std::uint32_t index, double size, std::vector<CellEntry>& entries) {
  const auto steps = static_cast<std::size_t>(std::min(std::ceil(2.0 * edge.length / size), 1e6)) + 1;
  const std::size_t first = entries.size();
  const double reach = 0.26 + std::min(0.1 * edge.metresPerTexel / size, 4.0);
  for (std::size_t k = 0; k <= steps; ++k) {
    const Vec3d p = edge.start + edge.direction * (edge.length * static_cast<double>(k) / static_cast<double>(steps));
    std::array<std::int64_t, 3> low{}, high{};
    for (int axis = 0; axis < 3; ++axis) {
      low[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(p[axis] / size - reach));
      high[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(p[axis] / size + reach));
    }
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z) entries.push_back({cellOf({x, y, z}), index});
  }
  const auto begin = entries.begin() + static_cast<std::ptrdiff_t>(first);
  std::sort(begin, entries.end());
  entries.erase(std::unique(begin, entries.end()), entries.end());
}

/// Whether the boxes of both come within a tenth of a texel, and they run along each other.
bool mayMeet(const BorderEdge& a, const BorderEdge& b) {
  constexpr double kLeastCosine = 0.9;
  if (std::abs(glm::dot(a.direction, b.direction)) < kLeastCosine) return false;
  const double margin = 0.1 * std::max(a.metresPerTexel, b.metresPerTexel);
  for (int axis = 0; axis < 3; ++axis) {
    if (std::max(a.start[axis], a.end[axis]) + margin < std::min(b.start[axis], b.end[axis])) return false;
    if (std::max(b.start[axis], b.end[axis]) + margin < std::min(a.start[axis], a.end[axis])) return false;
  }
  return true;
}

}  // namespace

Vec3d BorderEdge::pointAt(const Vec2d& texelOnEdge) const {
  return start + direction * (glm::dot(texelOnEdge - startTexel, perMetre[0]) / glm::dot(perMetre[0], perMetre[0]));
}

std::vector<BorderEdge> borderEdges(const Atlas& atlas) {
  std::vector<std::vector<BorderEdge>> bySurface(atlas.surfaces.size());
  parallelFor(atlas.surfaces.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s)
      for (const std::uint32_t side : openSides(atlas.surfaces[s]))
        if (const auto edge = edgeOf(atlas, static_cast<std::uint32_t>(s), side)) bySurface[s].push_back(*edge);
  });
  std::vector<BorderEdge> all;
  for (std::vector<BorderEdge>& edges : bySurface) {
    all.insert(all.end(), edges.begin(), edges.end());
    edges = {};
  }
  return all;
}

Frame frameOn(const Atlas& atlas, const BorderEdge& edge, double share) {
  const Surface& surface = atlas.surfaces[edge.surface];
  const std::size_t first = std::size_t{3} * edge.triangle;
  const std::uint32_t a = surface.indices[first + edge.corner];
  const std::uint32_t b = surface.indices[first + (edge.corner + 1) % 3];
  const auto w = static_cast<float>(share);
  const Vec3 normal = (1.0f - w) * surface.normals[a] + w * surface.normals[b];
  const float length2 = glm::dot(normal, normal);
  const bool isSmooth = length2 > 1e-12f && std::isfinite(length2);
  return frameFromTangent(isSmooth ? normal / std::sqrt(length2) : Vec3(edge.normal),
                          (1.0f - w) * surface.tangents[a] + w * surface.tangents[b]);
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> neighboursOf(const std::vector<BorderEdge>& edges) {
  double total = 0.0;
  for (const BorderEdge& edge : edges) total += edge.length;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  if (edges.empty()) return found;
  const double size = total / static_cast<double>(edges.size());
  std::vector<CellEntry> entries;
  for (std::uint32_t i = 0; i < edges.size(); ++i) enter(edges[i], i, size, entries);
  std::sort(entries.begin(), entries.end());
  for (std::size_t i = 0; i < entries.size();) {
    std::size_t end = i + 1;
    while (end < entries.size() && entries[end].cell == entries[i].cell) ++end;
    if (end - i <= kMostInCell)
      for (std::size_t a = i; a < end; ++a)
        for (std::size_t b = a + 1; b < end; ++b)
          if (mayMeet(edges[entries[a].edge], edges[entries[b].edge]))
            found.emplace_back(entries[a].edge, entries[b].edge);
    i = end;
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace lumel
