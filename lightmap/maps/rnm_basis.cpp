#include "lightmap/maps/rnm_basis.h"

#include <algorithm>

namespace lumel {

const char* nameOf(RnmDecode decode) {
  switch (decode) {
    case RnmDecode::Squared:
      return "squared";
    case RnmDecode::Linear:
      return "linear";
    case RnmDecode::LinearNormalized:
      return "linear-normalized";
  }
  return "?";
}

Vec3 rnmWeights(const Vec3& normalTangent, RnmDecode decode) {
  Vec3 w;
  for (int i = 0; i < 3; ++i) w[i] = std::max(0.0f, glm::dot(normalTangent, kRnmBasis[static_cast<std::size_t>(i)]));
  if (decode == RnmDecode::Linear) return w;
  if (decode == RnmDecode::Squared) w *= w;
  const float sum = w.x + w.y + w.z;
  return sum > 0 ? w / sum : Vec3(0.0f);
}

}  // namespace lumel
