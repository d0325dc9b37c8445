// zh3: Roughton, Sloan, Silvennoinen, Iwanicki and Shirley 2024, "ZH3: Quadratic Zonal Harmonics". Two bands of
// spherical harmonics, and of the third band the part that is symmetric about the direction of the second.
#include <algorithm>

#include "lightmap/maps/encoding_entries.h"
#include "scene/base/each_cpu.h"

namespace lumel {
namespace {

/// Irradiance / pi of the third band is (1/pi) Integral L(w) (5/16) P2(n.w) dw (A_2 = pi / 4, Ramamoorthi and Hanrahan
/// 2001), and (5/16) P2(n.w) = k ((n.w)^2 - 1/3): a form of n whose matrix has no trace, k (w w^T - 1/3).
constexpr float kThirdBand = 15.0f / 32.0f;

inline void thirdBand(float x, float y, float z, float k, float& xy, float& yz, float& zx, float& xxyy, float& zz) {
  xy = k * (x * y);
  yz = k * (y * z);
  zx = k * (z * x);
  xxyy = k * (x * x - y * y);
  zz = k * (z * z - 1.0f / 3.0f);
}

LUMEL_FOR_EACH_CPU void thirdBandLanes(const float* x, const float* y, const float* z, KernelLanes& lanes) {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane)
    thirdBand(x[lane], y[lane], z[lane], z[lane] > 0.0f ? kThirdBand : 0.0f, lanes.of[4][lane], lanes.of[5][lane],
              lanes.of[6][lane], lanes.of[7][lane], lanes.of[8][lane]);
}

/// The third band's form, of maps in the order of its kernels.
Vec3 thirdBandOn(std::span<const Vec3> maps, const Vec3& n) {
  const Vec3 xx = 0.5f * (maps[3] - maps[4]), yy = -0.5f * (maps[3] + maps[4]);
  return 2.0f * (n.x * n.y * maps[0] + n.y * n.z * maps[1] + n.z * n.x * maps[2]) + n.x * n.x * xx + n.y * n.y * yy +
         n.z * n.z * maps[4];
}

/// What is sampled for zh3: its first maps are sh1's.
class ThreeBandEncoding : public Encoding {
 public:
  explicit ThreeBandEncoding(Projection projection)
      : Encoding({.name = "sh2",
                  .mapNames = {"sh1-0", "sh1-x", "sh1-y", "sh1-z", "sh2-xy", "sh2-yz", "sh2-zx", "sh2-xxyy", "sh2-zz"},
                  .isSigned = true,
                  .conventions = {{"basis", "polynomials of a unit vector in tangent space (t, b, n)"},
                                  {"order", "L0, L.xyz, then the third band"},
                                  {"decode", "sh2"},
                                  {"decodeFormula", "L = max(0, L0 + N.L + N^T M N)"}}}),
        twoBands_(sh1Encoding(projection)) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    MapKernels k = twoBands_->kernels(dirTangent);
    thirdBand(dirTangent.x, dirTangent.y, dirTangent.z, dirTangent.z > 0.0f ? kThirdBand : 0.0f, k[4], k[5], k[6], k[7],
              k[8]);
    return k;
  }
  void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const override {
    twoBands_->laneKernels(x, y, z, lanes);
    thirdBandLanes(x, y, z, lanes);
  }
  void finish(std::span<Vec3> maps, const Vec3& flat) const override { twoBands_->finish(maps.first(4), flat); }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& n) const override {
    const Vec3 light = maps[0] + n.x * maps[1] + n.y * maps[2] + n.z * maps[3] + thirdBandOn(maps.subspan(4), n);
    return glm::max(light, Vec3(0.0f));
  }

 private:
  std::shared_ptr<const Encoding> twoBands_;
};

/// The unit vector along which the luminance of a vector of colours points; the normal where it is nothing.
Vec3 axisOf(const Vec3& x, const Vec3& y, const Vec3& z) {
  const Vec3 v(luminance(x), luminance(y), luminance(z));
  const float length = glm::length(v);
  return length > 0.0f ? v / length : Vec3(0.0f, 0.0f, 1.0f);
}

float secondLegendre(float x) { return 1.5f * x * x - 0.5f; }

class Zh3Encoding : public Encoding {
 public:
  explicit Zh3Encoding(Projection projection)
      : Encoding(
            {.name = "zh3",
             .mapNames = {"zh3-0", "zh3-x", "zh3-y", "zh3-z", "zh3-zonal"},
             .isSigned = true,
             .conventions = {{"basis",
                              "1 and x, y, z of a unit vector in tangent space (t, b, n), and the second Legendre "
                              "polynomial about the axis A"},
                             {"order", "maps 0 to 4: L0, Lx, Ly, Lz, Z"},
                             {"decode", "zh3"},
                             {"decodeFormula",
                              "L = max(0, L0 + N.x Lx + N.y Ly + N.z Lz + Z (3 (N.A)^2 - 1) / 2), A = normalize of "
                              "the luminances (.2126, .7152, .0722) of (Lx, Ly, Lz)"},
                             {"projection", nameOf(projection)}},
             .source = std::make_shared<ThreeBandEncoding>(projection)}),
        isExactOnFlat_(projection != Projection::Raw) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return source()->kernels(dirTangent); }
  /// Z is the third band's light on the axis, since P2(1) = 1. What the flat normal lacks goes to Lz, which turns the
  /// axis, which changes Z: a few rounds settle that, and L0 takes what is left.
  void derive(std::span<const Vec3> sampled, const Vec3& flat, std::span<Vec3> maps) const override {
    const std::span<const Vec3> third = sampled.subspan(4);
    std::copy_n(sampled.begin(), 3, maps.begin());
    maps[3] = 0.5f * flat;
    Vec3 axis = axisOf(maps[1], maps[2], maps[3]);
    maps[4] = thirdBandOn(third, axis);
    if (!isExactOnFlat_) return;
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      maps[3] = flat - maps[0] - maps[4] * secondLegendre(axis.z);
      axis = axisOf(maps[1], maps[2], maps[3]);
      maps[4] = thirdBandOn(third, axis);
    }
    maps[0] = flat - maps[3] - maps[4] * secondLegendre(axis.z);
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& n) const override {
    const float along = glm::dot(n, axisOf(maps[1], maps[2], maps[3]));
    const Vec3 light = maps[0] + n.x * maps[1] + n.y * maps[2] + n.z * maps[3] + secondLegendre(along) * maps[4];
    return glm::max(light, Vec3(0.0f));
  }

 private:
  bool isExactOnFlat_;
};

}  // namespace

Expected<std::shared_ptr<const Encoding>> statedZh3Encoding(const Conventions& conventions) {
  return std::shared_ptr<const Encoding>(std::make_shared<Zh3Encoding>(statedExactness(conventions)));
}

}  // namespace lumel
