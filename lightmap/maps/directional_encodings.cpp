// ahd and dominant: light that comes mostly from one direction. Both are made of the two bands that sh1 samples.
#include <algorithm>
#include <cmath>

#include "lightmap/maps/encoding_entries.h"

namespace lumel {
namespace {

/// Two bands of a texel's light above its surface, undone of sh1's exactness on flat normals: the kernel of the
/// vector's third coordinate is half of the flat map's.
struct TwoBands {
  Vec3 constant;
  std::array<Vec3, 3> vector;

  TwoBands(std::span<const Vec3> sh1, const Vec3& flat) : constant(sh1[0]), vector{sh1[1], sh1[2], 0.5f * flat} {}
  Vec3 vectorLuminance() const { return {luminance(vector[0]), luminance(vector[1]), luminance(vector[2])}; }
  Vec3 vectorAlong(const Vec3& d) const { return d.x * vector[0] + d.y * vector[1] + d.z * vector[2]; }
};

/// Directions become values from 0 to 1, as textures hold them.
Vec3 packed(const Vec3& direction) { return 0.5f * direction + 0.5f; }
Vec3 unpacked(const Vec3& map) { return 2.0f * map - 1.0f; }

/// The unit vector along v; the normal where v is nothing.
Vec3 directionOf(const Vec3& v) {
  const float length = glm::length(v);
  return length > 0.0f && std::isfinite(length) ? v / length : Vec3(0.0f, 0.0f, 1.0f);
}

/// Ambient and highlight: L = A + D max(0, N.d), one direction d for all colours, that of the luminance of the vector.
///
/// Each colour's two bands are read as an even sky of radiance s above the surface and a light of irradiance / pi D0
/// along d (Iwanicki 2013 reads them as light from all around, which is too bright on a surface that only sees half of
/// it):  L0 = s/2 + D0/4  and  L.d = (s/2) d.z + D0/2, so  D0 = (L.d - L0 d.z) / (1/2 - d.z/4),  s = 2 L0 - D0/2.
/// The sky's irradiance s (1 + N.z) / 2 has to be shared between A and D. As Sloan and Silvennoinen 2018 do, the flat
/// normal's irradiance is held, A = flat - D d.z, and within what that leaves free D is the best over the hemisphere of
/// normals: with g = max(0, N.d) - d.z,
///   D = D0 + s Integral g (N.z - 1)/2 / Integral g^2.
/// With p = Integral max(0, N.d) = pi (1 + d.z) / 2 and m = Integral max(0, N.d) N = (2/3) ((pi - theta) d + (0, 0, sin
/// theta)), d theta off the normal,
///   Integral g^2 = m.d - 2 d.z p + 2 pi d.z^2,   Integral g (N.z - 1) = m.z - d.z pi - (p - 2 pi d.z).
/// Neither A nor D is negative: 0 <= D <= flat / d.z.
class AhdEncoding : public Encoding {
 public:
  explicit AhdEncoding(Projection projection)
      : Encoding({.name = "ahd",
                  .mapNames = {"ahd-ambient", "ahd-light", "ahd-dir"},
                  .conventions = {{"basis", "a unit vector d in tangent space (t, b, n), stored as d / 2 + 1/2"},
                                  {"order", "ambient light A, light D along d, direction d"},
                                  {"decode", "ahd"},
                                  {"decodeFormula", "L = A + D max(0, N.d), d = normalize(2 map - 1)"}},
                  .source = sh1Encoding(projection)}) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return source()->kernels(dirTangent); }
  void derive(std::span<const Vec3> sampled, const Vec3& flat, std::span<Vec3> maps) const override {
    const TwoBands bands(sampled, flat);
    const Vec3 d = directionOf(bands.vectorLuminance());
    const float share = skyShare(d);
    const Vec3 along = bands.vectorAlong(d);
    for (int c = 0; c < 3; ++c) {
      const float own = std::max(0.0f, (along[c] - bands.constant[c] * d.z) / (0.5f - 0.25f * d.z));
      const float sky = std::max(0.0f, 2.0f * bands.constant[c] - 0.5f * own);
      const float most = d.z > kLeastHeight ? flat[c] / d.z : std::max(own, 0.0f);
      const float light = std::clamp(own + share * sky, 0.0f, std::max(0.0f, most));
      maps[0][c] = std::max(0.0f, flat[c] - light * d.z);
      maps[1][c] = light;
    }
    maps[2] = packed(d);
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    return maps[0] + maps[1] * std::max(0.0f, glm::dot(normalTangent, directionOf(unpacked(maps[2]))));
  }

 private:
  /// Below, a flat normal says nothing of the light along d.
  static constexpr float kLeastHeight = 1e-4f;

  /// D - D0 for a sky of radiance 1.
  static float skyShare(const Vec3& d) {
    const float z = std::clamp(d.z, 0.0f, 1.0f);
    const float left = kPi - std::acos(z);
    const float sine = std::sqrt(1.0f - z * z);
    const float p = 0.5f * kPi * (1.0f + z);
    const float mz = (2.0f / 3.0f) * (left * z + sine);
    const float md = (2.0f / 3.0f) * (left + sine * z);
    const float square = md - 2.0f * z * p + 2.0f * kPi * z * z;
    return 0.5f * (mz - z * kPi - (p - 2.0f * kPi * z)) / square;
  }
};

/// One direction beside the flat map: the mean of where light comes from, weighed by luminance, as long as light is
/// concentrated. Readers turn it into half a cosine and hold the flat normal's light.
class DominantEncoding : public Encoding {
 public:
  explicit DominantEncoding(Projection projection)
      : Encoding({.name = "dominant",
                  .mapNames = {kFlatMap, "dominant-dir"},
                  .conventions = {{"basis",
                                   "the mean direction d of light in tangent space (t, b, n), of length 0 (even) to 1 "
                                   "(one light), stored as d / 2 + 1/2"},
                                  {"order", "the flat map, the direction"},
                                  {"decode", "dominant"},
                                  {"decodeFormula",
                                   "L = flat (dot(N, D - 1/2) + 1/2) / max(1e-4, D.z), D = map; D.z is the weight that "
                                   "engines keep as the fourth channel"}},
                  .source = sh1Encoding(projection)}) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return source()->kernels(dirTangent); }
  void derive(std::span<const Vec3> sampled, const Vec3& flat, std::span<Vec3> maps) const override {
    const TwoBands bands(sampled, flat);
    const float constant = luminance(bands.constant);
    Vec3 d(0.0f);
    if (constant > 0.0f) d = bands.vectorLuminance() / (2.0f * constant);
    // Noise that was averaged with the flat map may have moved the two apart.
    if (const float length = glm::length(d); !(length <= 1.0f)) d = directionOf(d);
    maps[0] = flat;
    maps[1] = packed(d);
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    const Vec3 d = maps[1] - 0.5f;
    return maps[0] * std::max(0.0f, (glm::dot(normalTangent, d) + 0.5f) / std::max(1e-4f, maps[1].z));
  }
};

}  // namespace

Expected<std::shared_ptr<const Encoding>> statedAhdEncoding(const Conventions& conventions) {
  return std::shared_ptr<const Encoding>(std::make_shared<AhdEncoding>(statedExactness(conventions)));
}

Expected<std::shared_ptr<const Encoding>> statedDominantEncoding(const Conventions& conventions) {
  return std::shared_ptr<const Encoding>(std::make_shared<DominantEncoding>(statedExactness(conventions)));
}

}  // namespace lumel
