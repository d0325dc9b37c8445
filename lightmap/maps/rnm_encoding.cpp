// rnm of encoding.h: three maps, one for each vector of the RNM basis.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "lightmap/maps/encoding_entries.h"
#include "scene/base/each_cpu.h"

namespace lumel {
namespace {

LUMEL_FOR_EACH_CPU void clampedDots(const float* x, const float* y, const float* z, KernelLanes& lanes) {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
    const Vec3 dir(x[lane], y[lane], z[lane]);
    const float above = dir.z > 0.0f ? 1.0f : 0.0f;
    lanes.of[0][lane] = above * std::max(0.0f, glm::dot(dir, kRnmBasis[0]));
    lanes.of[1][lane] = above * std::max(0.0f, glm::dot(dir, kRnmBasis[1]));
    lanes.of[2][lane] = above * std::max(0.0f, glm::dot(dir, kRnmBasis[2]));
  }
}

LUMEL_FOR_EACH_CPU void plainDots(const float* x, const float* y, const float* z, KernelLanes& lanes) {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
    const Vec3 dir(x[lane], y[lane], z[lane]);
    const float above = dir.z > 0.0f ? 1.0f : 0.0f;
    lanes.of[0][lane] = above * glm::dot(dir, kRnmBasis[0]);
    lanes.of[1][lane] = above * glm::dot(dir, kRnmBasis[1]);
    lanes.of[2][lane] = above * glm::dot(dir, kRnmBasis[2]);
  }
}

std::string describeRnmBasis() {
  std::string basis;
  for (std::size_t i = 0; i < kRnmBasis.size(); ++i) {
    const Vec3d b(kRnmBasis[i]);
    char text[96];
    std::snprintf(text, sizeof text, "%sB%zu = (%.9g, %.9g, %.9g)", i == 0 ? "" : "; ", i, b.x, b.y, b.z);
    basis += text;
  }
  return basis + "; in tangent space (t, b, n), orthonormal";
}

const char* weightsOf(RnmDecode decode) {
  switch (decode) {
    case RnmDecode::Squared:
      return "saturate(N.B_i)^2 / sum_j saturate(N.B_j)^2";
    case RnmDecode::Linear:
      return "saturate(N.B_i)";
    case RnmDecode::LinearNormalized:
      return "saturate(N.B_i) / sum_j saturate(N.B_j)";
  }
  return "?";
}

class RnmEncoding : public Encoding {
 public:
  RnmEncoding(Projection projection, RnmDecode decode)
      : Encoding({.name = "rnm",
                  .mapNames = {"rnm0", "rnm1", "rnm2"},
                  .isSigned = projection == Projection::Signed,
                  .conventions = {{"basis", describeRnmBasis()},
                                  {"order", "map i belongs to Bi; a frame of the other handedness swaps maps 1 and 2"},
                                  {"decode", nameOf(decode)},
                                  {"decodeFormula", (projection == Projection::Signed ? "L = max(0, sum w_i map_i)"
                                                                                      : "L = sum w_i map_i") +
                                                        std::string(", w_i = ") + weightsOf(decode)},
                                  {"projection", nameOf(projection)}}}),
        kernels_(projection),
        projection_(projection),
        decode_(decode) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    const Vec3 k = kernels_(dirTangent);
    return {k.x, k.y, k.z};
  }
  void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const override {
    if (kernels_.clampedDots())
      clampedDots(x, y, z, lanes);
    else if (kernels_.plainDots())
      plainDots(x, y, z, lanes);
    else
      Encoding::laneKernels(x, y, z, lanes);
  }
  void finish(std::span<Vec3> maps, const Vec3& flat) const override {
    const auto finished = finishTexel(projection_, {maps[0], maps[1], maps[2]}, flat);
    std::copy(finished.begin(), finished.end(), maps.begin());
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    const Vec3 light = decodeRnm({maps[0], maps[1], maps[2]}, normalTangent, decode_);
    return isSigned() ? glm::max(light, Vec3(0.0f)) : light;
  }

 private:
  RnmKernels kernels_;
  Projection projection_;
  RnmDecode decode_;
};

/// The one of `values` that has this name.
template <class Value>
std::optional<Value> named(const std::string& name, std::initializer_list<Value> values) {
  for (const Value value : values)
    if (name == nameOf(value)) return value;
  return std::nullopt;
}

RnmDecode usualDecode(Projection projection) {
  return projection == Projection::Signed ? RnmDecode::Linear : RnmDecode::Squared;
}

}  // namespace

std::shared_ptr<const Encoding> rnmEncoding(Projection projection, RnmDecode decode) {
  return std::make_shared<RnmEncoding>(projection, decode);
}
std::shared_ptr<const Encoding> rnmEncoding(Projection projection) {
  return rnmEncoding(projection, usualDecode(projection));
}

Expected<std::shared_ptr<const Encoding>> statedRnmEncoding(const Conventions& conventions) {
  const std::string projectionName = statedOr(conventions, "projection", nameOf(Projection::Flat));
  const auto projection =
      named(projectionName, {Projection::Raw, Projection::Flat, Projection::Fit, Projection::Signed});
  if (!projection) return inputError("'" + projectionName + "' is not a projection of rnm that this version knows");
  const std::string decodeName = statedOr(conventions, "decode", nameOf(usualDecode(*projection)));
  const auto decode = named(decodeName, {RnmDecode::Squared, RnmDecode::Linear, RnmDecode::LinearNormalized});
  if (!decode) return inputError("'" + decodeName + "' is not a decode of rnm that this version knows");
  return rnmEncoding(*projection, *decode);
}

}  // namespace lumel
