#include "lightmap/charts/triangle_connectivity.h"

#include <algorithm>

namespace lumel {

TriangleConnectivity::TriangleConnectivity(std::span<const std::int32_t> opposite)
    : kernel_(std::make_unique<OpenMesh::TriConnectivity>()) {
  const auto borders = static_cast<std::size_t>(std::count(opposite.begin(), opposite.end(), -1));
  const std::size_t triangles = opposite.size() / 3;
  kernel_->resize(0, (opposite.size() + borders) / 2, triangles);
  kernel_->reserve(triangles / 2 + borders + 3, kernel_->n_edges(), triangles);
  int edges = 0;
  for (std::size_t t = 0; t < triangles; ++t) {
    std::array<HalfedgeHandle, 3> sides;
    const OpenMesh::FaceHandle face(static_cast<int>(t));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t other = opposite[3 * t + k];
      const bool isNew = other < 0 || static_cast<std::size_t>(other) > 3 * t + k;
      sides[k] = isNew ? kernel_->halfedge_handle(OpenMesh::EdgeHandle(edges++), 0)
                       : beyond(side(static_cast<std::size_t>(other / 3), static_cast<std::size_t>(other % 3)));
      kernel_->set_face_handle(sides[k], face);
    }
    for (std::size_t k = 0; k < 3; ++k) kernel_->set_next_halfedge_handle(sides[k], sides[(k + 1) % 3]);
    kernel_->set_halfedge_handle(face, sides[0]);
  }
  for (std::size_t t = 0; t < triangles; ++t)
    for (std::size_t k = 0; k < 3; ++k)
      if (!kernel_->from_vertex_handle(side(t, k)).is_valid()) addVertexAt(side(t, k));
}

/// Makes the vertex that the half-edge starts from: turns around it over the fan of triangles and, if the fan is open,
/// links the border's two half-edges there.
void TriangleConnectivity::addVertexAt(HalfedgeHandle outgoing) {
  const OpenMesh::VertexHandle vertex = kernel_->new_vertex();
  HalfedgeHandle out = outgoing;
  do {  // counter-clockwise
    kernel_->set_vertex_handle(beyond(out), vertex);
    out = beyond(kernel_->prev_halfedge_handle(out));
  } while (out != outgoing && !isBorder(out));
  kernel_->set_halfedge_handle(vertex, out);
  if (out == outgoing) return;
  kernel_->set_vertex_handle(beyond(out), vertex);
  HalfedgeHandle in = beyond(outgoing);
  while (!isBorder(in)) {  // clockwise
    in = beyond(kernel_->next_halfedge_handle(in));
    kernel_->set_vertex_handle(in, vertex);
  }
  kernel_->set_next_halfedge_handle(in, out);
}

std::vector<std::int32_t> TriangleConnectivity::opposites() const {
  std::vector<std::int32_t> opposite;
  opposite.reserve(3 * size());
  for (std::size_t t = 0; t < size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle other = beyond(side(t, k));
      opposite.push_back(isBorder(other) ? -1 : static_cast<std::int32_t>(3 * triangleOf(other) + numberOf(other)));
    }
  return opposite;
}

std::vector<std::uint32_t> TriangleConnectivity::firstCorners() const {
  std::vector<std::uint32_t> first;
  first.reserve(vertexCount());
  for (std::uint32_t t = 0; t < size(); ++t) {
    const std::array<std::uint32_t, 3> vertices = corners(t);
    for (std::uint32_t k = 0; k < 3; ++k)
      if (vertices[k] == first.size()) first.push_back(3 * t + k);
  }
  return first;
}

}  // namespace lumel
