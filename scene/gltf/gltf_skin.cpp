#include "scene/gltf/gltf_skin.h"

#include "scene/gltf/gltf_accessor.h"

namespace lumel {

Expected<std::vector<Mat4>> jointMatrices(const GltfDocument& document, int skin,
                                          std::span<const glm::dmat4> worldFromNode) {
  const auto& source = document.model.skins[static_cast<std::size_t>(skin)];
  std::vector<Mat4> inverseBind(source.joints.size(), Mat4(1.0f));
  if (source.inverseBindMatrices >= 0) {
    auto read = readArray<Mat4>(document, source.inverseBindMatrices);
    if (!read) return read.error();
    if (read->size() < source.joints.size())
      return document.error(
          "skins/" + std::to_string(skin) + "/inverseBindMatrices",
          "has " + std::to_string(read->size()) + " matrices for " + std::to_string(source.joints.size()) + " joints");
    inverseBind = *std::move(read);
  }
  std::vector<Mat4> matrices;
  for (std::size_t j = 0; j < source.joints.size(); ++j)
    matrices.emplace_back(worldFromNode[static_cast<std::size_t>(source.joints[j])] * glm::dmat4(inverseBind[j]));
  return matrices;
}

void transformVertex(Primitive& primitive, std::size_t v, const Mat4& m) {
  primitive.positions[v] = Vec3(m * Vec4(primitive.positions[v], 1.0f));
  if (!primitive.normals.empty()) {
    const Mat3 cofactor = cofactorMatrix(Mat3(m));
    const float side = glm::dot(Vec3(m[0]), cofactor[0]) < 0 ? -1.0f : 1.0f;
    primitive.normals[v] = side * (cofactor * primitive.normals[v]);
  }
  if (!primitive.tangents.empty())
    primitive.tangents[v] = Vec4(Mat3(m) * Vec3(primitive.tangents[v]), primitive.tangents[v].w);
}

bool SkinBlend::add(std::span<const Mat4> jointMatrices, std::span<const Vec4> joints, std::span<const Vec4> weights) {
  for (std::size_t v = 0; v < matrices_.size(); ++v)
    for (int k = 0; k < 4; ++k) {
      const float weight = weights[v][k];
      if (!(weight > 0)) continue;
      const float joint = joints[v][k];
      if (!(joint >= 0 && joint < static_cast<float>(jointMatrices.size()))) return false;
      matrices_[v] += weight * jointMatrices[static_cast<std::size_t>(joint)];
      weights_[v] += weight;
    }
  return true;
}

void SkinBlend::apply(Primitive& primitive) const {
  for (std::size_t v = 0; v < matrices_.size(); ++v)
    if (weights_[v] > 0) transformVertex(primitive, v, matrices_[v] / weights_[v]);
}

}  // namespace lumel
