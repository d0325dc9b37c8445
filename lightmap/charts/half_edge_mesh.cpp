#include "lightmap/charts/half_edge_mesh.h"

#include <algorithm>

#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

constexpr double kDegenerateArea = 1e-12;  // of the longest edge's square: below the rounding of float coordinates
constexpr float kFrameCos = 0.9965f;       // tangents more than 4.8 degrees apart are two frames
constexpr float kHardCos = 0.9986f;
constexpr double kFoldCos = -0.5;  // sheets of a non-manifold edge are paired unless they fold back on each other

struct Side {               // of an edge: one triangle's half-edge
  std::uint32_t low, high;  // welded points
  std::uint32_t corner;     // 3 * triangle + k: runs from corner k to k + 1
};

std::uint32_t nextCorner(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

class Builder {
 public:
  explicit Builder(TriangleSoup&& soup) : soup_(std::move(soup)), welded_(weldPositions(soup_.points.positions)) {
    mesh_.points.toTexels = soup_.points.toTexels;
  }

  HalfEdgeMesh build() {
    keepTriangles();
    pairSides();
    release(soup_.normals, soup_.frames, welded_, normals_);
    connect();
    return std::move(mesh_);
  }

 private:
  template <class... Arrays>
  static void release(Arrays&... arrays) {
    ((arrays = Arrays()), ...);
  }

  /// Corners are those of kept triangles.
  std::uint32_t vertexAt(std::uint32_t corner) const { return soup_.indices[corner]; }
  std::uint32_t pointAt(std::uint32_t corner) const { return welded_[vertexAt(corner)]; }

  void keepTriangles() {
    for (std::uint32_t t = 0; t < soup_.triangleCount(); ++t) {
      const std::uint32_t* v = &soup_.indices[3 * t];
      const Vec3d a = soup_.points[v[0]];
      const Vec3d b = soup_.points[v[1]];
      const Vec3d c = soup_.points[v[2]];
      const Vec3d areaNormal = glm::cross(b - a, c - a);
      const double longest2 = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
      const double area = 0.5 * glm::length(areaNormal);
      if (!(area > kDegenerateArea * longest2)) {
        mesh_.leftOut.push_back(t);
        continue;
      }
      normals_.push_back(Vec3(areaNormal / (2 * area)));
      bool back = true;
      for (std::size_t k = 0; k < 3; ++k) back = back && glm::dot(soup_.normals[v[k]], normals_.back()) < 0;
      shadedFromBehind_.push_back(back);
      std::copy_n(v, 3, &soup_.indices[3 * (normals_.size() - 1)]);
    }
    soup_.indices.resize(3 * normals_.size());
  }

  /// Whether a chart may run across the edge, as the material's frame has it; and whether it is shaded hard.
  bool framesAgree(std::uint32_t cornerA, std::uint32_t cornerB, bool& hard) const {
    const std::uint32_t a[2] = {vertexAt(cornerA), vertexAt(nextCorner(cornerA))};
    const std::uint32_t b[2] = {vertexAt(nextCorner(cornerB)), vertexAt(cornerB)};
    hard = false;
    // Normals are turned to the front as a whole triangle's: beside one that is not, the frame turns over.
    if (shadedFromBehind_[cornerA / 3] != shadedFromBehind_[cornerB / 3]) return false;
    for (int i = 0; i < 2; ++i) {
      if (a[i] == b[i]) continue;
      if (glm::dot(soup_.normals[a[i]], soup_.normals[b[i]]) < kHardCos) hard = true;
      const Vec4& frameA = soup_.frames[a[i]];
      const Vec4& frameB = soup_.frames[b[i]];
      if ((frameA.w == 0) != (frameB.w == 0)) return false;
      if (frameA.w == 0) continue;
      if (frameA.w * frameB.w < 0 || !(glm::dot(Vec3(frameA), Vec3(frameB)) >= kFrameCos)) return false;
    }
    return true;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    bool isHard = false;
    if (!framesAgree(a, b, isHard)) {
      mesh_.frameBreaks.push_back({a, b});
      return;
    }
    opposite_[a] = static_cast<std::int32_t>(b);
    opposite_[b] = static_cast<std::int32_t>(a);
    if (!isHard) return;
    mesh_.hardEdges[a / 3] |= static_cast<std::uint8_t>(1u << a % 3);
    mesh_.hardEdges[b / 3] |= static_cast<std::uint8_t>(1u << b % 3);
  }

  void pairSides() {
    const std::uint32_t corners = static_cast<std::uint32_t>(soup_.indices.size());
    std::vector<Side> sides(corners);
    for (std::uint32_t corner = 0; corner < corners; ++corner) {
      const std::uint32_t a = pointAt(corner);
      const std::uint32_t b = pointAt(nextCorner(corner));
      sides[corner] = {std::min(a, b), std::max(a, b), corner};
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
    });
    opposite_.assign(corners, -1);
    mesh_.hardEdges.assign(corners / 3, 0);
    for (std::size_t first = 0, last; first < sides.size(); first = last) {
      for (last = first + 1;
           last < sides.size() && sides[last].low == sides[first].low && sides[last].high == sides[first].high;)
        ++last;
      const std::size_t count = last - first;
      if (count == 2 && pointAt(sides[first].corner) != pointAt(sides[first + 1].corner))
        join(sides[first].corner, sides[first + 1].corner);
      else if (count >= 2)
        pairSheets(&sides[first], count);
    }
  }

  /// More than two sides, or two of contrary winding: each side finds the flattest partner of opposite direction.
  void pairSheets(const Side* sides, std::size_t count) {
    ++mesh_.nonManifoldEdges;
    struct Pair {
      float cosine;
      std::uint32_t forward, backward;
    };
    std::vector<Pair> pairs;
    constexpr std::size_t kMostSides = 256;  // a fan of more sheets is left as separate sheets: n^2 pairs
    if (count > kMostSides) return;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < count; ++j) {
        const std::uint32_t a = sides[i].corner;
        const std::uint32_t b = sides[j].corner;
        if (pointAt(a) != sides[i].low || pointAt(b) == sides[j].low) continue;
        const float cosine = glm::dot(normals_[a / 3], normals_[b / 3]);
        if (cosine > kFoldCos) pairs.push_back({cosine, a, b});
      }
    std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.cosine > b.cosine; });
    for (const Pair& pair : pairs)
      if (opposite_[pair.forward] < 0 && opposite_[pair.backward] < 0) join(pair.forward, pair.backward);
  }

  /// Corners that are joined around a point become one vertex: points where sheets merely touch are cut apart.
  void connect() {
    static_cast<TriangleConnectivity&>(mesh_) = TriangleConnectivity(opposite_);
    release(opposite_);
    for (const std::uint32_t corner : mesh_.firstCorners())
      mesh_.points.positions.push_back(soup_.points.positions[vertexAt(corner)]);
    mesh_.points.positions.shrink_to_fit();
  }

  TriangleSoup soup_;
  std::vector<std::uint32_t> welded_;
  std::vector<Vec3> normals_;           // per kept triangle
  std::vector<bool> shadedFromBehind_;  // per kept triangle: all its normals point away from its front
  std::vector<std::int32_t> opposite_;  // per corner: the corner of the paired side, or -1
  HalfEdgeMesh mesh_;
};

}  // namespace

std::vector<Vec3d> TexelPoints::all() const {
  std::vector<Vec3d> points(size());
  for (std::size_t i = 0; i < size(); ++i) points[i] = (*this)[i];
  return points;
}

std::uint32_t HalfEdgeMesh::sourceOf(std::uint32_t triangle) const {
  // leftOut[i] - i kept triangles come before the one left out.
  std::size_t low = 0, high = leftOut.size();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (leftOut[middle] - middle <= triangle ? low = middle + 1 : high = middle);
  }
  return triangle + static_cast<std::uint32_t>(low);
}

HalfEdgeMesh buildHalfEdgeMesh(TriangleSoup soup) { return Builder(std::move(soup)).build(); }

}  // namespace lumel
