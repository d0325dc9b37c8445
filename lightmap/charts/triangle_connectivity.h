// The one door to OpenMesh: which triangles share an edge or a vertex, as a half-edge mesh.
#pragma once

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lumel {

using HalfedgeHandle = OpenMesh::HalfedgeHandle;

/// The half-edge mesh of a list of triangles; face i is triangle i. Corner k of a triangle is where its side k, the
/// half-edge from corner k to corner k + 1, begins. Every vertex is one fan of triangles, open or closed: triangles
/// that only touch at a point have vertices of their own there.
class TriangleConnectivity {
 public:
  TriangleConnectivity() = default;

  /// `opposite`: per side (3 * triangle + k) the side that it shares an edge with, of contrary direction, or -1 at the
  /// border. Vertices are numbered by their first corner.
  /// It is made with OpenMesh's kernel and not by add_face, which admits one edge between two vertices only: a sheet
  /// may meet itself at both ends of an edge.
  explicit TriangleConnectivity(std::span<const std::int32_t> opposite);

  const OpenMesh::TriConnectivity& halfEdges() const { return *kernel_; }
  std::size_t size() const { return kernel_ ? kernel_->n_faces() : 0; }  // triangles
  std::size_t vertexCount() const { return kernel_ ? kernel_->n_vertices() : 0; }

  HalfedgeHandle side(std::size_t triangle, std::size_t k) const {
    HalfedgeHandle h = kernel_->halfedge_handle(OpenMesh::FaceHandle(static_cast<int>(triangle)));
    for (; k > 0; --k) h = kernel_->next_halfedge_handle(h);
    return h;
  }
  /// The triangle left of a half-edge that is not the border's.
  std::uint32_t triangleOf(HalfedgeHandle side) const {
    return static_cast<std::uint32_t>(kernel_->face_handle(side).idx());
  }
  /// Which of its triangle's sides a half-edge is.
  std::uint32_t numberOf(HalfedgeHandle side) const {
    const HalfedgeHandle first = kernel_->halfedge_handle(kernel_->face_handle(side));
    return side == first ? 0 : kernel_->next_halfedge_handle(first) == side ? 1 : 2;
  }
  /// The same edge as the triangle beyond runs it; the border's half-edge where there is none.
  HalfedgeHandle beyond(HalfedgeHandle side) const { return kernel_->opposite_halfedge_handle(side); }
  bool isBorder(HalfedgeHandle side) const { return kernel_->is_boundary(side); }
  std::uint32_t startOf(HalfedgeHandle side) const {
    return static_cast<std::uint32_t>(kernel_->from_vertex_handle(side).idx());
  }
  std::uint32_t endOf(HalfedgeHandle side) const {
    return static_cast<std::uint32_t>(kernel_->to_vertex_handle(side).idx());
  }

  /// The triangle's vertices.
  std::array<std::uint32_t, 3> corners(std::size_t triangle) const {
    const HalfedgeHandle first = side(triangle, 0);
    const HalfedgeHandle second = kernel_->next_halfedge_handle(first);
    return {endOf(kernel_->next_halfedge_handle(second)), endOf(first), endOf(second)};
  }
  /// The triangle beyond side k, or -1 at the border.
  std::int32_t neighbour(std::size_t triangle, std::size_t k) const {
    return kernel_->face_handle(beyond(side(triangle, k))).idx();
  }
  std::array<std::int32_t, 3> neighbours(std::size_t triangle) const {
    std::array<std::int32_t, 3> found;
    HalfedgeHandle h = side(triangle, 0);
    for (std::int32_t& n : found) {
      n = kernel_->face_handle(beyond(h)).idx();
      h = kernel_->next_halfedge_handle(h);
    }
    return found;
  }

  /// What the constructor was given: per side the one beyond, or -1.
  std::vector<std::int32_t> opposites() const;
  /// Per vertex its first corner (3 * triangle + k).
  std::vector<std::uint32_t> firstCorners() const;

 private:
  void addVertexAt(HalfedgeHandle outgoing);

  std::unique_ptr<OpenMesh::TriConnectivity> kernel_;  // OpenMesh's meshes cannot be moved
};

}  // namespace lumel
