// Emission in textures: integrals against brute force, and lamps of a few texels found, sampled and weighed as they
// are.
#include <gtest/gtest.h>

#include <random>

#include "baker/light/emission_field.h"
#include "baker/light/emissive_triangles.h"
#include "baker/rays/sampling.h"
#include "scene/images/image_io.h"
#include "tests/baker/one_sample.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

constexpr Vec3 kLuminance(0.2126f, 0.7152f, 0.0722f);

/// A texture of random greys, most of them black, kept in a scene.
struct Noise {
  TestScene test;
  Texture texture;

  Noise(int width, int height, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Vec4> pixels;
    for (int i = 0; i < width * height; ++i)
      pixels.emplace_back(Vec3(random() % 4 == 0 ? static_cast<float>(random() % 256) / 255.0f : 0.0f), 1.0f);
    const int image = test.addImage(width, height, pixels);
    texture = *Texture::decode(test.scene.images[static_cast<std::size_t>(image)], ColorSpace::Srgb);
  }
};

TextureRef refOf(Wrap u, Wrap v, bool nearest) {
  TextureRef ref;
  ref.wrapU = u;
  ref.wrapV = v;
  ref.nearest = nearest;
  return ref;
}

TexelPolygon triangleOf(const EmissionField& field, const std::array<Vec2, 3>& uvs) {
  TexelPolygon polygon;
  for (const Vec2& uv : uvs) polygon.add(field.pointOf(uv));
  return polygon;
}

std::array<Vec2, 3> randomUvs(std::mt19937& random) {
  std::uniform_real_distribution<float> in(-1.7f, 2.3f);
  std::array<Vec2, 3> uvs;
  for (Vec2& uv : uvs) uv = {in(random), in(random)};
  return uvs;
}

// Every wrap mode, interpolated and not, triangles that leave the texture on all sides: the exact integral is the mean
// of 2048 x 2048 midpoints times the area.
TEST(EmissionField, IntegralsAgreeWithBruteForce) {
  const Noise noise(21, 13, 3);
  std::mt19937 random(5);
  for (const Wrap u : {Wrap::Repeat, Wrap::Mirror, Wrap::Clamp})
    for (const Wrap v : {Wrap::Repeat, Wrap::Mirror, Wrap::Clamp})
      for (const bool nearest : {false, true}) {
        const TextureRef ref = refOf(u, v, nearest);
        const EmissionField field(noise.texture, ref, kLuminance);
        const std::array<Vec2, 3> uvs = randomUvs(random);
        const TexelPolygon triangle = triangleOf(field, uvs);
        constexpr int kGrid = 2048;
        double sum = 0;
        for (int i = 0; i < kGrid; ++i)
          for (int j = 0; j < kGrid; ++j) {
            const Vec2 b = sampleTriangle((Vec2(i, j) + 0.5f) / static_cast<float>(kGrid));
            const Vec2 uv = (1.0f - b.x - b.y) * uvs[0] + b.x * uvs[1] + b.y * uvs[2];
            sum += static_cast<double>(luminance(Vec3(noise.texture.sample(ref, uv)))) / (kGrid * kGrid);
          }
        const double exact = field.integral(triangle) / triangle.area();
        // Midpoints against steps and bends between texels: 2048 of them across about 50 texels.
        EXPECT_NEAR(exact / sum, 1.0, nearest ? 4e-3 : 5e-4) << static_cast<int>(u) << static_cast<int>(v) << nearest;
        // Cut into two, the parts have the whole's light to rounding.
        const double middle = (triangle.corners[0].x + triangle.corners[1].x + triangle.corners[2].x) / 3;
        const TexelPolygon left = clipped(triangle, {{-1e4, -1e4}, {middle, 1e4}});
        const TexelPolygon right = clipped(triangle, {{middle, -1e4}, {1e4, 1e4}});
        EXPECT_NEAR((field.integral(left) + field.integral(right)) / triangle.area(), exact, 1e-9 * exact);
      }
}

// Boxes do not overlap and hold every point that shines, whatever their number.
TEST(EmissionField, BoxesHoldAllThatShines) {
  const Noise noise(40, 30, 8);
  std::mt19937 random(6);
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Mirror, Wrap::Clamp})
    for (const std::size_t most : {1u, 7u, 100u}) {
      const TextureRef ref = refOf(wrap, wrap, most == 7);
      const EmissionField field(noise.texture, ref, kLuminance);
      const std::array<Vec2, 3> uvs = randomUvs(random);
      const TexelPolygon triangle = triangleOf(field, uvs);
      const std::vector<TexelBox> boxes = field.divide(triangle, Vec2d(1.0), most);
      double light = 0;
      for (const TexelBox& box : boxes) light += field.integral(clipped(triangle, box));
      // What is missing or counted twice would show here.
      EXPECT_NEAR(light / field.integral(triangle), 1.0, 1e-9) << most;
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const Vec2 b = sampleTriangle(sobol2D(i, 1));
        const Vec2 uv = (1.0f - b.x - b.y) * uvs[0] + b.x * uvs[1] + b.y * uvs[2];
        if (!(luminance(Vec3(noise.texture.sample(ref, uv))) > 1e-6f)) continue;
        const Vec2d p = field.pointOf(uv);
        EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(),
                                [&](const TexelBox& box) {
                                  return p.x >= box.min.x - 1e-4 && p.x <= box.max.x + 1e-4 &&
                                         p.y >= box.min.y - 1e-4 && p.y <= box.max.y + 1e-4;
                                }))
            << p.x << ' ' << p.y;
      }
    }
}

/// A facade of 8 x 8 m at z = 0 that faces +z, of which windows of a texture shine.
struct Facade {
  TestScene test;
  std::vector<std::string> notes;
  std::unique_ptr<Materials> materials;
  std::unique_ptr<RayScene> rays;
  EmissiveTriangles lights;

  /// `windows`: first texel and size of each, rows from the top.
  Facade(int size, const std::vector<std::array<int, 4>>& windows, bool nearest) {
    std::vector<Vec4> pixels(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), Vec4(0, 0, 0, 1));
    for (const auto& [x, y, w, h] : windows)
      for (int v = y; v < y + h; ++v)
        for (int u = x; u < x + w; ++u) pixels[static_cast<std::size_t>(v * size + u)] = Vec4(1.0f);
    const int lit = test.addMaterial(Vec3(0.0f), Vec3(10.0f));
    Material& material = test.scene.materials[static_cast<std::size_t>(lit)];
    material.emissionMap.image = test.addImage(size, size, pixels);
    material.emissionMap.nearest = nearest;
    test.addRectangle({-4, 0, 0}, {8, 0, 0}, {0, 8, 0}, {.material = lit, .texels = 0});
    build();
  }
  void build() {
    materials = std::make_unique<Materials>(test.scene, true, notes);
    rays = std::move(*RayScene::build(test.scene, *materials));
    lights = EmissiveTriangles(*rays, *materials);
  }
};

/// Irradiance / pi at p, facing n, of a window of radiance 10 of a Facade.
double windowLight(const Vec3d& p, const Vec3d& n, int size, const std::array<int, 4>& window) {
  const double step = 8.0 / size;
  const double x0 = -4 + window[0] * step, x1 = x0 + window[2] * step;
  const double y1 = 8 - window[1] * step, y0 = y1 - window[3] * step;
  return 10 * polygonLight(p, n, n, {{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}});
}

// One texel of a million, anywhere, is never missed: every sample finds it, with the light of the same texel as a quad.
TEST(EmissiveTriangles, OneTexelOfAMillionIsAQuad) {
  const Vec3 p(0.3f, 1.0f, 3.0f), n(0, 0, -1);
  for (const auto& [x, y] : {std::pair{0, 0}, std::pair{511, 700}, std::pair{1023, 1023}, std::pair{400, 623}}) {
    const std::array<int, 4> window = {x, y, 1, 1};
    const Facade facade(1024, {window}, true);
    ASSERT_FALSE(facade.lights.empty());
    double sum = 0;
    int found = 0;
    constexpr std::uint32_t kSamples = 4096;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const LightSample s = sampleOne(facade.lights, p, sobol1D(i, 1), sobol2D(i, 2));
      found += s.weight != Vec3(0.0f);
      sum += static_cast<double>(s.weight.x * std::max(0.0f, glm::dot(s.wi, n))) / std::numbers::pi / kSamples;
    }
    // All but those within rounding of the texel's border.
    EXPECT_GE(found, 0.998 * kSamples);
    // Texture coordinates are floats: 1024 texels have borders to 1e-4 of a texel.
    EXPECT_NEAR(sum / windowLight(Vec3d(p), Vec3d(n), 1024, window), 1.0, 2e-3) << x << ' ' << y;
  }
}

// The parts' densities are those of hits, and add up to one over what shines.
TEST(EmissiveTriangles, PartsHaveTheDensitiesOfTheirSamples) {
  const std::vector<std::array<int, 4>> windows = {
      {10, 10, 20, 9}, {70, 30, 8, 8}, {40, 60, 3, 30}, {100, 100, 28, 28}};
  for (const bool nearest : {false, true}) {
    const Facade facade(128, windows, nearest);
    const Vec3 p(0.3f, 2.0f, 2.0f);
    double inverse = 0;
    int met = 0, same = 0;
    constexpr std::uint32_t kSamples = 8192;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const LightSample s = sampleOne(facade.lights, p, sobol1D(i, 1), sobol2D(i, 2));
      if (s.weight == Vec3(0.0f)) continue;
      RayPacket packet;
      packet.set(0, p, s.wi);
      facade.rays->intersect(packet, TraceMode::Packet);
      if (!packet.hit(0)) continue;
      ++met;
      same += std::abs(facade.lights.pdf(facade.rays->surfaceAt(packet, 0), p) / s.pdf - 1.0f) < 2e-3f;
      inverse += 1.0 / static_cast<double>(s.pdf) / kSamples;
    }
    EXPECT_GE(met, 0.8 * kSamples);
    // Samples within rounding of a part's border may be hit in the next one.
    EXPECT_GE(same, 0.998 * met);
    // The mean of 1 / pdf is the solid angle of what shines: between the windows' own and that with a texel around.
    double least = 0, most = 0;
    for (const auto& [x, y, w, h] : windows) {
      const auto solidAngle = [&](double grown) {
        const double step = 8.0 / 128;
        const double x0 = -4 + (x - grown) * step, x1 = x0 + (w + 2 * grown) * step;
        const double y1 = 8 - (y - grown) * step, y0 = y1 - (h + 2 * grown) * step;
        const Vec3d q(p);
        const Vec3d a = Vec3d(x0, y0, 0) - q, b = Vec3d(x1, y0, 0) - q, c = Vec3d(x1, y1, 0) - q,
                    d = Vec3d(x0, y1, 0) - q;
        return SphericalTriangle{glm::normalize(a), glm::normalize(b), glm::normalize(c)}.solidAngle() +
               SphericalTriangle{glm::normalize(a), glm::normalize(c), glm::normalize(d)}.solidAngle();
      };
      least += solidAngle(0.0);
      most += solidAngle(1.0);
    }
    EXPECT_GT(inverse, 0.99 * least);
    EXPECT_LT(inverse, 1.01 * most);
  }
}

// A window of a large texture costs about what the same window as a quad costs: the spread of single samples is at most
// 1.3 times as wide.
TEST(EmissiveTriangles, AWindowIsAboutAQuad) {
  const std::array<int, 4> window = {300, 612, 20, 24};
  const Facade facade(1024, {window}, true);
  TestScene plain;
  const float step = 8.0f / 1024;
  plain.addRectangle({-4 + 300 * step, 8 - 636 * step, 0}, {20 * step, 0, 0}, {0, 24 * step, 0},
                     {.material = plain.addMaterial(Vec3(0.0f), Vec3(10.0f)), .texels = 0});
  std::vector<std::string> notes;
  const Materials materials(plain.scene, true, notes);
  auto rays = RayScene::build(plain.scene, materials);
  ASSERT_TRUE(rays);
  const EmissiveTriangles quad(**rays, materials);
  const auto spread = [](const EmissiveTriangles& lights) {
    double sum = 0, squares = 0;
    constexpr std::uint32_t kSamples = 4096;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const LightSample s = sampleOne(lights, {-1.5f, 0.0f, 0.4f}, sobol1D(i, 1), sobol2D(i, 2));
      const auto light = static_cast<double>(s.weight.x * std::max(0.0f, s.wi.y)) / kSamples;
      sum += light;
      squares += light * light * kSamples;
    }
    return std::pair{sum, std::sqrt(squares - sum * sum) / sum};
  };
  const auto [lightOfParts, spreadOfParts] = spread(facade.lights);
  const auto [lightOfQuad, spreadOfQuad] = spread(quad);
  EXPECT_NEAR(lightOfParts / lightOfQuad, 1.0, 0.01);
  EXPECT_LT(spreadOfParts, 1.3 * spreadOfQuad + 0.01) << "quad: " << spreadOfQuad;
}

// What is black all over is no lamp, exactly: neither where the triangle lies beside the only texel that shines.
TEST(EmissiveTriangles, DarkIsDecidedExactly) {
  EXPECT_TRUE(Facade(64, {}, false).lights.empty());
  Facade beside(64, {{40, 40, 1, 1}}, true);
  for (Vec2& uv : beside.test.scene.meshes[0].primitives[0].uvSets[0]) uv *= 0.6f;  // up to texel 38.4
  beside.build();
  EXPECT_TRUE(beside.lights.empty());
  // All corners on one texel, as palettes have it: a point in the texture, with the texel's light.
  Facade palette(64, {{40, 40, 1, 1}}, true);
  for (Vec2& uv : palette.test.scene.meshes[0].primitives[0].uvSets[0]) uv = Vec2(40.5f / 64);
  palette.build();
  EXPECT_FALSE(palette.lights.empty());
  for (Vec2& uv : palette.test.scene.meshes[0].primitives[0].uvSets[0]) uv = Vec2(42.5f / 64);
  palette.build();
  EXPECT_TRUE(palette.lights.empty());
}

}  // namespace
}  // namespace lumel
