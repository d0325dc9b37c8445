// The decodes that ship to engines, lightmap/shaders, are compiled as C++ and held against the library's.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>

#include "lightmap/maps/encoding.h"

namespace lumel {
namespace {

namespace glsl {
using vec3 = Vec3;
using glm::dot;
using glm::inversesqrt;
using glm::max;
#include "lightmap/shaders/lumel_decode.glsl"
}  // namespace glsl

/// Maps as a texel may hold them, of two colours of light.
std::vector<Vec3> someMaps(const Encoding& encoding) {
  const Encoding& sampled = encoding.source() ? *encoding.source() : encoding;
  std::vector<Vec3> sums(sampled.mapCount(), Vec3(0)), maps(encoding.mapCount());
  Vec3 flat(0);
  for (const auto& [w, color] :
       {std::pair(Vec3(0.6f, 0.0f, 0.8f), Vec3(3, 2, 1)), std::pair(Vec3(-0.48f, 0.64f, 0.6f), Vec3(0.1f, 0.5f, 2))}) {
    const MapKernels k = encoding.kernels(w);
    for (std::size_t map = 0; map < sums.size(); ++map) sums[map] += k[map] * color;
    flat += w.z * color;
  }
  sampled.finish(sums, flat);
  encoding.derive(sums, flat, maps);
  return maps;
}

template <class Decode>
void expectSame(const std::shared_ptr<const Encoding>& encoding, const Decode& decode) {
  const std::vector<Vec3> maps = someMaps(*encoding);
  for (const Vec3& lean : {Vec3(0, 0, 1), Vec3(0.5f, 0.1f, 0.8f), Vec3(-0.9f, -0.3f, 0.2f), Vec3(0.1f, 0.9f, 0.3f)}) {
    const Vec3 n = glm::normalize(lean);
    const Vec3 light = decode(maps, n), expected = encoding->decode(maps, n);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(light[c], expected[c], 1e-5f * (1 + expected[c])) << encoding->name();  // rounding
  }
}

TEST(Shaders, DecodeAsTheLibrary) {
  using Maps = const std::vector<Vec3>&;
  const auto made = [](const char* name) { return *findEncoding(name, {}); };
  expectSame(rnmEncoding(), [](Maps m, Vec3 n) { return glsl::lumelDecodeRnm(m[0], m[1], m[2], n); });
  expectSame(rnmEncoding(Projection::Signed),
             [](Maps m, Vec3 n) { return glsl::lumelDecodeRnmSigned(m[0], m[1], m[2], n); });
  expectSame(made("sh1"), [](Maps m, Vec3 n) { return glsl::lumelDecodeSh1(m[0], m[1], m[2], m[3], n); });
  expectSame(made("h4"), [](Maps m, Vec3 n) { return glsl::lumelDecodeH4(m[0], m[1], m[2], m[3], n); });
  expectSame(made("zh3"), [](Maps m, Vec3 n) { return glsl::lumelDecodeZh3(m[0], m[1], m[2], m[3], m[4], n); });
  expectSame(made("ahd"), [](Maps m, Vec3 n) { return glsl::lumelDecodeAhd(m[0], m[1], m[2], n); });
  expectSame(made("dominant"), [](Maps m, Vec3 n) { return glsl::lumelDecodeDominant(m[0], m[1], n); });
}

std::string textOf(const std::string& file) {
  std::ifstream in(LUMEL_SOURCE_DIR "/lightmap/shaders/" + file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// HLSL's is the same text in its words.
TEST(Shaders, HlslIsGlslInOtherWords) {
  std::string text = textOf("lumel_decode.glsl");
  ASSERT_FALSE(text.empty());
  text = std::regex_replace(text, std::regex("vec3\\(([0-9.]+)\\)"), "float3($1, $1, $1)");
  text = std::regex_replace(text, std::regex("\\bvec3\\b"), "float3");
  text = std::regex_replace(text, std::regex("inversesqrt"), "rsqrt");
  EXPECT_EQ(text, textOf("lumel_decode.hlsl"));
}

}  // namespace
}  // namespace lumel
