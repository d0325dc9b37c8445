#include "ssbump/maps/weights.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lightmap/maps/rnm_basis.h"
#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel::ssbump {
namespace {

constexpr float kSqrt3 = 1.7320508075688772f;

Vec3 swapHand(const Vec3& s) { return {s.x, s.z, s.y}; }

Vec3 toSquared(const Vec3& s, Convention from) {
  if (from == Convention::Squared) return s;
  if (from == Convention::Mod2x) return s / 1.5f;
  const float length = glm::length(s);
  return length > 0 ? s * s / length : Vec3(0.0f);
}

Vec3 fromSquared(const Vec3& s, Convention to) {
  if (to == Convention::Squared) return s;
  if (to == Convention::Mod2x) return s * 1.5f;
  return glm::sqrt(glm::max(s * (s.x + s.y + s.z), Vec3(0.0f)));
}

void forEachRow(const Image& image, const std::function<void(int)>& body) {
  parallelFor(static_cast<std::size_t>(image.height), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) body(static_cast<int>(y));
  });
}

}  // namespace

Expected<Convention> parseConvention(const std::string& text) {
  if (text == "squared") return Convention::Squared;
  if (text == "linear") return Convention::Linear;
  if (text == "mod2x") return Convention::Mod2x;
  return usageError("unknown weight convention '" + text + "'; use squared, linear or mod2x");
}

Expected<Hand> parseHand(const std::string& text) {
  if (text == "right") return Hand::Right;
  if (text == "left") return Hand::Left;
  return usageError("unknown handedness '" + text + "'; use right or left");
}

const char* nameOf(Convention convention) {
  return convention == Convention::Squared ? "squared" : convention == Convention::Linear ? "linear" : "mod2x";
}

const char* nameOf(Hand hand) { return hand == Hand::Right ? "right" : "left"; }

float flatValue(Convention convention) {
  return convention == Convention::Squared ? 1.0f / 3 : convention == Convention::Linear ? 1 / kSqrt3 : 0.5f;
}

void normalWeights(const Vec3& n, Convention convention, std::span<const Vec3> basis, std::span<float> out) {
  if (basis.empty()) basis = kRnmBasis;
  LUMEL_CHECK(out.size() == basis.size());
  float sum = 0;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    const float dot = std::max(0.0f, glm::dot(n, basis[i]));
    out[i] = convention == Convention::Linear ? dot : dot * dot;
    sum += out[i];
  }
  if (convention == Convention::Linear) return;
  const float scale =
      sum > 0 ? (convention == Convention::Mod2x ? 0.5f * static_cast<float>(basis.size()) : 1.0f) / sum : 0.0f;
  for (float& w : out) w *= scale;
}

Vec3 normalWeights(const Vec3& n, Convention convention) {
  std::array<float, 3> w{};
  normalWeights(n, convention, {}, w);
  return {w[0], w[1], w[2]};
}

Vec3 recoveredNormal(const Vec3& s, Convention convention) {
  const Vec3 clean = glm::max(s, Vec3(0.0f));
  const Vec3 d = convention == Convention::Linear ? clean : glm::sqrt(clean);
  const Vec3 n = d.x * kRnmBasis[0] + d.y * kRnmBasis[1] + d.z * kRnmBasis[2];
  const float length = glm::length(n);
  return length > 0 && std::isfinite(length) ? n / length : Vec3(0, 0, 1);
}

float litBy(const Vec3& s, const Vec3& l) {
  float sum = 0;
  for (int i = 0; i < 3; ++i) {
    const float d = std::max(0.0f, glm::dot(l, kRnmBasis[static_cast<std::size_t>(i)]));
    sum += s[i] * d * d;
  }
  return sum;
}

Vec3 convert(const Vec3& s, const Encoding& from, const Encoding& to) {
  const Vec3 squared = toSquared(from.hand == Hand::Left ? swapHand(s) : s, from.convention);
  const Vec3 out = fromSquared(squared, to.convention);
  return to.hand == Hand::Left ? swapHand(out) : out;
}

void convert(Image& image, const Encoding& from, const Encoding& to) {
  LUMEL_CHECK(image.channels >= 3);
  if (from == to) return;
  forEachRow(image, [&](int y) {
    for (int x = 0; x < image.width; ++x) image.setRgb(x, y, convert(image.rgb(x, y), from, to));
  });
}

Vec3 sampleRepeated(const Image& image, float u, float v) {
  const auto cell = [](float t, int size, int& lo, int& hi) {
    const float p = (t - std::floor(t)) * static_cast<float>(size) - 0.5f;
    const float base = std::floor(p);
    lo = (static_cast<int>(base) + size) % size;
    hi = (lo + 1) % size;
    return p - base;
  };
  int x0, x1, y0, y1;
  const float fx = cell(u, image.width, x0, x1), fy = cell(v, image.height, y0, y1);
  const auto fetch = [&](int x, int y) { return image.channels >= 3 ? image.rgb(x, y) : Vec3(*image.at(x, y)); };
  return glm::mix(glm::mix(fetch(x0, y0), fetch(x1, y0), fx), glm::mix(fetch(x0, y1), fetch(x1, y1), fx), fy);
}

void blendDetail(Image& image, const Image& detail, const Encoding& encoding, float repeats) {
  const float scale = 1 / (3 * flatValue(encoding.convention));
  forEachRow(image, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(image.width) * repeats;
      const float v = (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height) * repeats;
      const Vec3 d = sampleRepeated(detail, u, v);
      image.setRgb(x, y, image.rgb(x, y) * ((d.x + d.y + d.z) * scale));
    }
  });
}

Expected<Image> crossFade(const Image& a, const Image& b, const Encoding& encoding, float amount) {
  if (a.width != b.width || a.height != b.height)
    return inputError("cross-fade: the maps differ in size (" + std::to_string(a.width) + "x" +
                      std::to_string(a.height) + " and " + std::to_string(b.width) + "x" + std::to_string(b.height) +
                      "); resize one of them");
  Image out = a;
  const Encoding squared{Convention::Squared, encoding.hand};
  forEachRow(out, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const Vec3 mixed =
          glm::mix(convert(a.rgb(x, y), encoding, squared), convert(b.rgb(x, y), encoding, squared), amount);
      out.setRgb(x, y, convert(mixed, squared, encoding));
    }
  });
  return out;
}

void modulateByAlbedo(Image& image, const Image& albedoLinear) {
  forEachRow(image, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const Vec3 albedo = sampleRepeated(albedoLinear, (static_cast<float>(x) + 0.5f) / static_cast<float>(image.width),
                                         (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height));
      image.setRgb(x, y, image.rgb(x, y) * luminance(albedo));
    }
  });
}

Vec3 decodeNormal(const Vec3& stored, Green green) {
  Vec3 n = 2.0f * stored - 1.0f;
  if (green == Green::Down) n.y = -n.y;
  n.z = std::max(n.z, 0.0f);
  const float length = glm::length(n);
  return length > 1e-6f ? n / length : Vec3(0, 0, 1);
}

Vec3 encodeNormal(const Vec3& n, Green green) {
  return 0.5f * Vec3(n.x, green == Green::Down ? -n.y : n.y, n.z) + 0.5f;
}

std::map<std::string, std::string> encodingMetadata(const Encoding& encoding) {
  const std::string convention = nameOf(encoding.convention), hand = nameOf(encoding.hand);
  return {{"lumel:ssbump", convention},
          {"lumel:ssbump:hand", hand},
          {"lumel:ssbump:basis",
           "rnm B0=(sqrt(2/3),0,1/sqrt3) B1=(-1/sqrt6,1/sqrt2,1/sqrt3) B2=(-1/sqrt6,-1/sqrt2,1/sqrt3)"},
          {"ImageDescription", "lumel ssbump convention=" + convention + " hand=" + hand}};
}

}  // namespace lumel::ssbump
