// sh1 of encoding.h: two bands of spherical harmonics.
#include "lightmap/maps/encoding_entries.h"
#include "scene/base/each_cpu.h"

namespace lumel {
namespace {

LUMEL_FOR_EACH_CPU void twoBands(const float* x, const float* y, const float* z, KernelLanes& lanes) {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
    const float above = z[lane] > 0.0f ? 1.0f : 0.0f;
    lanes.of[0][lane] = above * 0.25f;
    lanes.of[1][lane] = above * (0.5f * x[lane]);
    lanes.of[2][lane] = above * (0.5f * y[lane]);
    lanes.of[3][lane] = above * (0.5f * z[lane]);
  }
}

/// Kernels 1/4 and w/2: of irradiance(n) / pi = sum_l (A_l / pi) sum_m Y_lm(n) Integral L Y_lm with A_0 = pi,
/// A_1 = 2 pi / 3, the first band is (1/pi) Integral L / 4, the second n . (1/pi) Integral L w / 2. Two bands of a
/// light at the zenith are 3/4 of it on a flat normal; Lz = flat - L0 puts the rest along the normal, which holds for
/// light and for denoised light alike, since it is linear.
class Sh1Encoding : public Encoding {
 public:
  explicit Sh1Encoding(Projection projection)
      : Encoding({.name = "sh1",
                  .mapNames = {"sh1-0", "sh1-x", "sh1-y", "sh1-z"},
                  .isSigned = true,
                  .conventions = {{"basis", "1 and x, y, z of a unit vector in tangent space (t, b, n)"},
                                  {"order", "maps 0 to 3: L0, Lx, Ly, Lz"},
                                  {"decode", "sh1"},
                                  {"decodeFormula", "L = max(0, L0 + N.x Lx + N.y Ly + N.z Lz)"},
                                  {"projection", nameOf(projection)}}}),
        isExactOnFlat_(projection != Projection::Raw) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    if (!(dirTangent.z > 0.0f)) return {};
    return {0.25f, 0.5f * dirTangent.x, 0.5f * dirTangent.y, 0.5f * dirTangent.z};
  }
  void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const override {
    twoBands(x, y, z, lanes);
  }
  void finish(std::span<Vec3> maps, const Vec3& flat) const override {
    if (isExactOnFlat_) maps[3] = flat - maps[0];
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    const Vec3 light = maps[0] + normalTangent.x * maps[1] + normalTangent.y * maps[2] + normalTangent.z * maps[3];
    return glm::max(light, Vec3(0.0f));
  }

 private:
  bool isExactOnFlat_;
};

}  // namespace

std::shared_ptr<const Encoding> sh1Encoding(Projection projection) {
  return std::make_shared<Sh1Encoding>(projection == Projection::Raw ? Projection::Raw : Projection::Flat);
}

Expected<std::shared_ptr<const Encoding>> statedSh1Encoding(const Conventions& conventions) {
  if (statedOr(conventions, "projection", "") == nameOf(Projection::Fit)) return fittedSh1Encoding();
  return sh1Encoding(statedExactness(conventions));
}

}  // namespace lumel
