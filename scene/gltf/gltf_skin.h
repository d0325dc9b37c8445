// Skins in the pose that the file's nodes stand in (glTF 2.0, section 3.7.3). Private to scene/gltf_*.cpp.
#pragma once

#include <span>
#include <vector>

#include "scene/base/math.h"
#include "scene/gltf/gltf_document.h"
#include "scene/scene.h"

namespace lumel {

/// World from bind pose for each joint of the skin. worldFromNode has one entry per node.
Expected<std::vector<Mat4>> jointMatrices(const GltfDocument& document, int skin,
                                          std::span<const glm::dmat4> worldFromNode);

/// Applies a matrix to one vertex: position, tangent, and the normal by the cofactor matrix, which exists for any
/// matrix and is the inverse transpose up to scale.
void transformVertex(Primitive& primitive, std::size_t vertex, const Mat4& matrix);

/// Linear blend skinning: one matrix per vertex, the weighted mean of its joints'.
class SkinBlend {
 public:
  explicit SkinBlend(std::size_t vertices) : matrices_(vertices, Mat4(0.0f)), weights_(vertices, 0.0f) {}
  /// Adds a set of four influences per vertex; false if a joint does not exist.
  bool add(std::span<const Mat4> jointMatrices, std::span<const Vec4> joints, std::span<const Vec4> weights);
  /// Moves the vertices; one without weights stays.
  void apply(Primitive& primitive) const;

 private:
  std::vector<Mat4> matrices_;
  std::vector<float> weights_;
};

}  // namespace lumel
