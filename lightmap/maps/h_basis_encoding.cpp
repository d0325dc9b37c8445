// h4: the H-basis of Habel and Wimmer 2010, "Efficient Irradiance Normal Mapping", with four coefficients: polynomials
// that are orthonormal over the hemisphere of normals, H1 = 1 / sqrt(2 pi), and with k = sqrt(3 / 2 pi)
// H2 = k y, H3 = k (2 z - 1), H4 = k x.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "lightmap/maps/encoding_entries.h"
#include "scene/base/each_cpu.h"

namespace lumel {
namespace {

/// The arc cosine of x in [0, 1], within 1e-6 in float (Abramowitz and Stegun 1964, 4.4.46).
inline float arcCosine(float x) {
  float sum = -0.0012624911f;
  sum = sum * x + 0.0066700901f;
  sum = sum * x - 0.0170881256f;
  sum = sum * x + 0.0308918810f;
  sum = sum * x - 0.0501743046f;
  sum = sum * x + 0.0889789874f;
  sum = sum * x - 0.2145988016f;
  sum = sum * x + 1.5707963050f;
  return std::sqrt(std::max(0.0f, 1.0f - x)) * sum;
}

/// What one direction w, `theta` off the normal, adds to the line a + b.n that is the nearest to irradiance / pi over
/// the normals n of the hemisphere. With e = max(0, n.w) the integrals over it are, because n and w have a lune in
/// common,
///   Integral e = pi (1 + w.z) / 2,
///   Integral e n = (2/3) ((pi - theta) w + (0, 0, sin theta)),
/// and with Integral 1 = 2 pi, Integral z = pi, Integral z^2 = Integral x^2 = 2 pi / 3 the normal equations give
///   a = (2 Integral e - 3 Integral e n.z) / pi,   b.z = (6 Integral e n.z - 3 Integral e) / pi,
///   b.x = (1 - theta / pi) w.x, b.y alike.
inline void fitOf(float x, float y, float z, float& a, float& bx, float& by, float& bz) {
  constexpr float kLune = 2.0f * kInvPi / 3.0f;
  const float height = std::min(std::max(z, 0.0f), 1.0f);
  const float above = z > 0.0f ? 1.0f : 0.0f;
  const float left = kPi - arcCosine(height);
  const float sine = std::sqrt(std::max(0.0f, 1.0f - height * height));
  const float e = 0.5f * (1.0f + height);           // Integral e / pi
  const float ez = kLune * (left * height + sine);  // Integral e n.z / pi
  a = above * (2.0f * e - 3.0f * ez);
  bx = above * (left * kInvPi * x);
  by = above * (left * kInvPi * y);
  bz = above * (6.0f * ez - 3.0f * e);
}

LUMEL_FOR_EACH_CPU void fits(const float* x, const float* y, const float* z, KernelLanes& lanes) {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane)
    fitOf(x[lane], y[lane], z[lane], lanes.of[0][lane], lanes.of[1][lane], lanes.of[2][lane], lanes.of[3][lane]);
}

/// What is sampled for h4, and sh1 of projection fit: a and b of the line a + b.n that is the nearest to irradiance /
/// pi over the hemisphere, a scalar and a vector as sh1's, which readers decode alike. Exact on flat normals unless it
/// is raw: b.z = flat - a.
class HemisphereLine : public Encoding {
 public:
  HemisphereLine(const std::string& name, Projection projection)
      : Encoding({.name = name,
                  .mapNames = {name + "-0", name + "-x", name + "-y", name + "-z"},
                  .isSigned = true,
                  .conventions = conventionsOf(projection)}),
        isExactOnFlat_(projection != Projection::Raw) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    MapKernels k{};
    fitOf(dirTangent.x, dirTangent.y, dirTangent.z, k[0], k[1], k[2], k[3]);
    return k;
  }
  void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const override {
    fits(x, y, z, lanes);
  }
  void finish(std::span<Vec3> maps, const Vec3& flat) const override {
    if (isExactOnFlat_) maps[3] = flat - maps[0];
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& n) const override {
    return glm::max(maps[0] + n.x * maps[1] + n.y * maps[2] + n.z * maps[3], Vec3(0.0f));
  }

 private:
  static Conventions conventionsOf(Projection projection) {
    Conventions conventions = sh1Encoding()->conventions();
    conventions["projection"] = nameOf(projection);
    return conventions;
  }

  bool isExactOnFlat_;
};

class HBasisEncoding : public Encoding {
 public:
  explicit HBasisEncoding(Projection projection)
      : Encoding(
            {.name = "h4",
             .mapNames = {"h4-1", "h4-2", "h4-3", "h4-4"},
             .isSigned = true,
             .conventions = {{"basis",
                              "H1 = 1 / sqrt(2 pi), H2 = k y, H3 = k (2 z - 1), H4 = k x, k = sqrt(3 / (2 pi)), of "
                              "a unit vector in tangent space (t, b, n) with z >= 0"},
                             {"order", "map i belongs to Hi"},
                             {"decode", "h4"},
                             {"decodeFormula", "L = max(0, sum_i Hi(N) map_i)"},
                             {"projection", nameOf(projection)}},
             .source = std::make_shared<HemisphereLine>("line", projection)}) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return source()->kernels(dirTangent); }
  void derive(std::span<const Vec3> line, const Vec3&, std::span<Vec3> maps) const override {
    maps[0] = (line[0] + 0.5f * line[3]) / kH1;
    maps[1] = line[2] / kH2;
    maps[2] = 0.5f * line[3] / kH2;
    maps[3] = line[1] / kH2;
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& n) const override {
    const Vec3 light = kH1 * maps[0] + kH2 * (n.y * maps[1] + (2.0f * n.z - 1.0f) * maps[2] + n.x * maps[3]);
    return glm::max(light, Vec3(0.0f));
  }

 private:
  static constexpr float kH1 = 0.398942280f;  // 1 / sqrt(2 pi)
  static constexpr float kH2 = 0.690988299f;  // sqrt(3 / (2 pi))
};

}  // namespace

std::shared_ptr<const Encoding> fittedSh1Encoding() { return std::make_shared<HemisphereLine>("sh1", Projection::Fit); }

Expected<std::shared_ptr<const Encoding>> statedHBasisEncoding(const Conventions& conventions) {
  return std::shared_ptr<const Encoding>(std::make_shared<HBasisEncoding>(statedExactness(conventions)));
}

}  // namespace lumel
