#include <algorithm>
#include <cstdio>
#include <optional>

#include "lightmap/maps/encoding.h"
#include "scene/base/check.h"
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

class FlatEncoding : public Encoding {
 public:
  FlatEncoding()
      : Encoding({.name = "flat",
                  .mapNames = {"flat"},
                  .conventions = {{"basis", "the texel's normal"},
                                  {"order", "one map"},
                                  {"decode", "flat"},
                                  {"decodeFormula", "L = map"}}}) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return {std::max(0.0f, dirTangent.z)}; }
  Vec3 decode(std::span<const Vec3> maps, const Vec3&) const override { return maps[0]; }
};

/// Kernels 1/4 and w/2: of irradiance(n) / pi = sum_l (A_l / pi) sum_m Y_lm(n) Integral L Y_lm with A_0 = pi,
/// A_1 = 2 pi / 3, the first band is (1/pi) Integral L / 4, the second n . (1/pi) Integral L w / 2.
class Sh1Encoding : public Encoding {
 public:
  Sh1Encoding()
      : Encoding({.name = "sh1",
                  .mapNames = {"sh1-0", "sh1-x", "sh1-y", "sh1-z"},
                  .domain = Domain::Sphere,
                  .isSigned = true,
                  .conventions = {{"basis", "1 and x, y, z of a unit vector in tangent space (t, b, n)"},
                                  {"order", "maps 0 to 3: L0, Lx, Ly, Lz"},
                                  {"decode", "sh1"},
                                  {"decodeFormula", "L = max(0, L0 + N.x Lx + N.y Ly + N.z Lz)"}}}) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    return {0.25f, 0.5f * dirTangent.x, 0.5f * dirTangent.y, 0.5f * dirTangent.z};
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    const Vec3 light = maps[0] + normalTangent.x * maps[1] + normalTangent.y * maps[2] + normalTangent.z * maps[3];
    return glm::max(light, Vec3(0.0f));
  }
};

/// The one of `values` that has this name.
template <class Value>
std::optional<Value> named(const std::string& name, std::initializer_list<Value> values) {
  for (const Value value : values)
    if (name == nameOf(value)) return value;
  return std::nullopt;
}

/// What `conventions` says under a key, else the name of the usual choice.
std::string stated(const Conventions& conventions, const char* key, const char* usual) {
  const auto found = conventions.find(key);
  return found == conventions.end() ? usual : found->second;
}

Expected<std::shared_ptr<const Encoding>> statedRnm(const Conventions& conventions) {
  const std::string decodeName = stated(conventions, "decode", nameOf(RnmDecode::Squared));
  const auto decode = named(decodeName, {RnmDecode::Squared, RnmDecode::Linear, RnmDecode::LinearNormalized});
  if (!decode) return inputError("'" + decodeName + "' is not a decode of rnm that this version knows");
  const std::string projectionName = stated(conventions, "projection", nameOf(Projection::Flat));
  const auto projection =
      named(projectionName, {Projection::Raw, Projection::Flat, Projection::Fit, Projection::Signed});
  if (!projection) return inputError("'" + projectionName + "' is not a projection of rnm that this version knows");
  return rnmEncoding(*projection, *decode);
}

struct Entry {
  const char* name;
  Expected<std::shared_ptr<const Encoding>> (*make)(const Conventions& conventions);
};
constexpr std::array<Entry, 3> kEntries = {{
    {"rnm", statedRnm},
    {"flat", [](const Conventions&) -> Expected<std::shared_ptr<const Encoding>> { return flatEncoding(); }},
    {"sh1", [](const Conventions&) -> Expected<std::shared_ptr<const Encoding>> { return sh1Encoding(); }},
}};

}  // namespace

const char* nameOf(Domain domain) { return domain == Domain::Hemisphere ? "hemisphere" : "sphere"; }

void Encoding::laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
    const MapKernels k = kernels(Vec3(x[lane], y[lane], z[lane]));
    for (std::size_t map = 0; map < mapCount(); ++map) lanes.of[map][lane] = k[map];
  }
}

void Encoding::finish(std::span<Vec3>, const Vec3&) const {}

std::shared_ptr<const Encoding> rnmEncoding(Projection projection, RnmDecode decode) {
  return std::make_shared<RnmEncoding>(projection, decode);
}
std::shared_ptr<const Encoding> rnmEncoding(Projection projection) {
  return rnmEncoding(projection, projection == Projection::Signed ? RnmDecode::Linear : RnmDecode::Squared);
}
std::shared_ptr<const Encoding> flatEncoding() { return std::make_shared<FlatEncoding>(); }
std::shared_ptr<const Encoding> sh1Encoding() { return std::make_shared<Sh1Encoding>(); }

Expected<std::shared_ptr<const Encoding>> findEncoding(std::string_view name, const Conventions& conventions) {
  std::string known;
  for (const Entry& entry : kEntries) {
    if (entry.name == name) return entry.make(conventions);
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  return inputError("'" + std::string(name) + "' is not an encoding that this version knows (" + known + ")");
}

const std::vector<std::string>& knownMapNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Entry& entry : kEntries) {
      const auto encoding = entry.make({});
      LUMEL_CHECK(encoding && (*encoding)->mapCount() <= kMostMaps);
      all.insert(all.end(), (*encoding)->mapNames().begin(), (*encoding)->mapNames().end());
    }
    return all;
  }();
  return names;
}

}  // namespace lumel
