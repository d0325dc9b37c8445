#include "lightmap/charts/half_edge_mesh.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <numeric>

#include "scene/base/union_find.h"
#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

constexpr double kDegenerateArea = 1e-12;  // of the longest edge's square: below the rounding of float coordinates
constexpr float kFrameCos = 0.9965f;       // tangents more than 4.8 degrees apart are two frames
constexpr float kHardCos = 0.9986f;
constexpr double kFoldCos = -0.5;  // sheets of a non-manifold edge are paired unless they fold back on each other

struct MeshTraits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::None);
  HalfedgeAttributes(OpenMesh::Attributes::None);
  EdgeAttributes(OpenMesh::Attributes::None);
  FaceAttributes(OpenMesh::Attributes::None);
};
using OpenMeshMesh = OpenMesh::TriMesh_ArrayKernelT<MeshTraits>;

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
    cutIntoFans();
    fillOpenMesh();
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
  void cutIntoFans() {
    fan_.resize(opposite_.size());
    std::iota(fan_.begin(), fan_.end(), 0u);
    for (std::uint32_t corner = 0; corner < opposite_.size(); ++corner) {
      if (opposite_[corner] < static_cast<std::int32_t>(corner)) continue;
      const auto other = static_cast<std::uint32_t>(opposite_[corner]);
      unite(fan_, corner, nextCorner(other));
      unite(fan_, nextCorner(corner), other);
    }
  }

  void fillOpenMesh() {
    // A face that does not fit is told by add_face's result; OpenMesh would also print it.
    [[maybe_unused]] static const bool quiet = (omerr().disable(), true);
    OpenMeshMesh mesh;
    const std::size_t count = opposite_.size() / 3;
    const auto borders = static_cast<std::size_t>(std::count(opposite_.begin(), opposite_.end(), -1));
    mesh.reserve(count / 2 + borders + 3, (3 * count + borders) / 2 + 3, count);
    std::vector<int> vertexOfFan(fan_.size(), -1);
    mesh_.triangles.resize(count);
    for (std::uint32_t corner = 0; corner < fan_.size(); ++corner) {
      int& vertex = vertexOfFan[findRoot(fan_, corner)];
      if (vertex < 0) {
        vertex = mesh.add_vertex({}).idx();
        mesh_.points.positions.push_back(soup_.points.positions[vertexAt(corner)]);
      }
      mesh_.triangles[corner / 3][corner % 3] = static_cast<std::uint32_t>(vertex);
    }
    mesh_.points.positions.shrink_to_fit();
    release(soup_.points.positions, soup_.indices, fan_, vertexOfFan);
    std::vector<std::uint32_t> triangleOfFace;
    std::vector<std::uint32_t> misfits;
    for (const std::uint32_t t : sheetOrder()) {
      std::array<OpenMesh::VertexHandle, 3> v;
      for (std::size_t k = 0; k < 3; ++k) v[k] = OpenMesh::VertexHandle(static_cast<int>(mesh_.triangles[t][k]));
      if (fits(mesh, v) && mesh.add_face(v.data(), 3).is_valid())
        triangleOfFace.push_back(t);
      else
        misfits.push_back(t);
    }
    readNeighbours(mesh, triangleOfFace, misfits);
  }

  /// Triangles so that each one but the first of a sheet has a neighbour before it: OpenMesh links faces around a
  /// vertex as they come, and cannot always join patches that began apart.
  std::vector<std::uint32_t> sheetOrder() const {
    std::vector<std::uint32_t> order;
    std::vector<bool> seen(opposite_.size() / 3, false);
    for (std::uint32_t start = 0; start < seen.size(); ++start) {
      if (seen[start]) continue;
      seen[start] = true;
      order.push_back(start);
      for (std::size_t head = order.size() - 1; head < order.size(); ++head)
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::int32_t paired = opposite_[3 * order[head] + k];
          if (paired < 0 || seen[static_cast<std::size_t>(paired / 3)]) continue;
          seen[static_cast<std::size_t>(paired / 3)] = true;
          order.push_back(static_cast<std::uint32_t>(paired / 3));
        }
    }
    return order;
  }

  /// Whether add_face would keep the mesh manifold.
  static bool fits(const OpenMeshMesh& mesh, const std::array<OpenMesh::VertexHandle, 3>& v) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (v[k] == v[(k + 1) % 3] || !mesh.is_boundary(v[k])) return false;
      const auto halfedge = mesh.find_halfedge(v[k], v[(k + 1) % 3]);
      if (halfedge.is_valid() && !mesh.is_boundary(halfedge)) return false;
    }
    return true;
  }

  void readNeighbours(const OpenMeshMesh& mesh, const std::vector<std::uint32_t>& triangleOfFace,
                      const std::vector<std::uint32_t>& misfits) {
    mesh_.neighbours.assign(mesh_.triangles.size(), {-1, -1, -1});
    for (std::uint32_t face = 0; face < triangleOfFace.size(); ++face) {
      const std::uint32_t t = triangleOfFace[face];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::int32_t paired = opposite_[3 * t + k];
        if (paired < 0) continue;
        const auto halfedge =
            mesh.find_halfedge(OpenMesh::VertexHandle(static_cast<int>(mesh_.triangles[t][k])),
                               OpenMesh::VertexHandle(static_cast<int>(mesh_.triangles[t][(k + 1) % 3])));
        const auto other = mesh.face_handle(mesh.opposite_halfedge_handle(halfedge));
        // Two fans may share both ends of an edge that is a break: only paired sides are neighbours.
        if (other.is_valid() &&
            triangleOfFace[static_cast<std::size_t>(other.idx())] == static_cast<std::uint32_t>(paired / 3))
          mesh_.neighbours[t][k] = paired / 3;
      }
    }
    // OpenMesh knows one edge between two vertices. A sheet that meets itself at both ends of an edge has two there;
    // for its triangles the pairing made here stands.
    mesh_.selfMeetingTriangles = misfits.size();
    for (const std::uint32_t t : misfits)
      for (std::uint32_t k = 0; k < 3; ++k)
        if (const std::int32_t paired = opposite_[3 * t + k]; paired >= 0) {
          mesh_.neighbours[t][k] = paired / 3;
          mesh_.neighbours[static_cast<std::size_t>(paired / 3)][static_cast<std::size_t>(paired % 3)] =
              static_cast<std::int32_t>(t);
        }
  }

  TriangleSoup soup_;
  std::vector<std::uint32_t> welded_;
  std::vector<Vec3> normals_;           // per kept triangle
  std::vector<bool> shadedFromBehind_;  // per kept triangle: all its normals point away from its front
  std::vector<std::int32_t> opposite_;  // per corner: the corner of the paired side, or -1
  std::vector<std::uint32_t> fan_;      // per corner: union-find over corners joined around a point
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
