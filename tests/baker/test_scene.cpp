#include "tests/baker/test_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "scene/base/parallel.h"

namespace lumel::testing_scene {

int TestScene::addMaterial(const Vec3& albedo, const Vec3& emission) {
  Material m;
  m.baseColor = Vec4(albedo, 1.0f);
  m.emission = emission;
  scene.materials.push_back(m);
  return static_cast<int>(scene.materials.size()) - 1;
}

int TestScene::addImage(int width, int height, const std::vector<Vec4>& pixels) {
  Image image(width, height, 4);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (int c = 0; c < 4; ++c) image.pixels[4 * i + static_cast<std::size_t>(c)] = pixels[i][c];
  auto png = encodePng(image);
  EXPECT_TRUE(png) << png.error().message;
  ImageSource source;
  source.name = "image " + std::to_string(scene.images.size());
  source.mimeType = "image/png";
  source.encoded = *png;
  scene.images.push_back(source);
  return static_cast<int>(scene.images.size()) - 1;
}

int TestScene::addRectangle(const Vec3& corner, const Vec3& right, const Vec3& up, const RectangleOptions& options) {
  const Vec3 n = glm::normalize(glm::cross(right, up));
  Primitive primitive;
  primitive.name = "rectangle " + std::to_string(scene.instances.size());
  primitive.material = options.material;
  const std::vector<Vec3> world = {corner, corner + right, corner + right + up, corner + up};
  const std::vector<Vec2> uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  Mat4 worldFromObject(1.0f);
  if (options.flip) worldFromObject[0][0] = -1.0f;
  for (const Vec3& p : world) primitive.positions.push_back(Vec3(worldFromObject * Vec4(p, 1.0f)));
  primitive.normals.assign(4, Vec3(worldFromObject * Vec4(n, 0.0f)));
  primitive.uvSets = {uv};
  primitive.indices = {0, 1, 2, 0, 2, 3};
  const std::vector<std::uint32_t> worldIndices = primitive.indices;
  if (options.flip) primitive.indices = {0, 2, 1, 0, 3, 2};

  scene.meshes.push_back({primitive.name, {primitive}});
  Instance instance;
  instance.name = primitive.name;
  instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
  instance.worldFromObject = worldFromObject;
  instance.settings.casts = options.casts;
  scene.instances.push_back(instance);
  if (options.texels == 0) return -1;

  const int page = static_cast<int>(atlas.pages.size());
  atlas.pages.push_back({options.texels, options.texels});
  Surface surface;
  surface.instance = static_cast<int>(scene.instances.size()) - 1;
  surface.page = page;
  surface.positions = world;
  surface.normals.assign(4, n);
  surface.tangents.assign(4, Vec4(glm::normalize(right), 1.0f));
  surface.lightmapUvs = uv;
  surface.sourceVertex = {0, 1, 2, 3};
  surface.indices = worldIndices;
  surface.sourceTriangle = {0, 1};
  surface.charts.assign(2, static_cast<std::uint32_t>(atlas.charts.size()));
  atlas.charts.push_back({static_cast<int>(atlas.surfaces.size()), 1.0f});
  atlas.surfaces.push_back(surface);
  return page;
}

void TestScene::addRoom(const Vec3& min, const Vec3& max, const RectangleOptions& options) {
  const Vec3 x(max.x - min.x, 0, 0), y(0, max.y - min.y, 0), z(0, 0, max.z - min.z);
  addRectangle(min, z, x, options);    // floor, faces +y
  addRectangle(max, -x, -z, options);  // ceiling, faces -y
  addRectangle(min, y, z, options);    // faces +x
  addRectangle(max, -z, -y, options);  // faces -x
  addRectangle(min, x, y, options);    // faces +z
  addRectangle(max, -y, -x, options);  // faces -z
}

void TestScene::addInstance(int instance, const Mat4& worldFromObject, bool receives) {
  Instance copy = scene.instances[static_cast<std::size_t>(instance)];
  copy.worldFromObject = worldFromObject;
  copy.settings.receives = receives;
  scene.instances.push_back(copy);
}

Expected<BakeResult> TestScene::tryBake(const BakeOptions& options, int threads) const {
  const ThreadLimit limit(threads);
  Progress silent;
  BakeOptions chosen = options;
  chosen.integrator = integrator;
  return lumel::bake(scene, atlas, findTexels(atlas), chosen, silent);
}

BakeResult TestScene::bake(const BakeOptions& options, int threads) const {
  auto result = tryBake(options, threads);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  EXPECT_EQ(result->stats.nonFiniteSamples, 0u);
  return *std::move(result);
}

TestScene busyRoom(float scale, const Vec3& offset) {
  TestScene test;
  const auto at = [&](float x, float y, float z) { return offset + scale * Vec3(x, y, z); };
  const int wall = test.addMaterial({0.7f, 0.5f, 0.3f});
  const int lamp = test.addMaterial(Vec3(0.2f), {4, 3, 2});
  const int leaf = test.addMaterial({0.3f, 0.8f, 0.2f});
  test.addRectangle(at(0, 0, 4), scale * Vec3(4, 0, 0), scale * Vec3(0, 0, -4), {.material = wall, .texels = 13});
  test.addRectangle(at(0, 0, 0), scale * Vec3(4, 0, 0), scale * Vec3(0, 3, 0), {.material = wall, .texels = 9});
  test.addRectangle(at(1, 2.5f, 1), scale * Vec3(1, 0, 0), scale * Vec3(0, 0, 1), {.material = lamp});
  Material& m = test.scene.materials[static_cast<std::size_t>(leaf)];
  m.alphaMode = AlphaMode::Mask;
  m.doubleSided = true;
  m.baseColorMap.image = test.addImage(2, 2, {{1, 1, 1, 1}, {1, 1, 1, 0}, {1, 1, 1, 0}, {1, 1, 1, 1}});
  m.baseColorMap.nearest = true;
  test.addRectangle(at(2, 1, 2), scale * Vec3(1, 0, 0), scale * Vec3(0, 0, -1), {.material = leaf});
  Mat4 moved(1.0f);
  moved[3] = Vec4(scale * Vec3(1, 0.5f, 0.5f), 1.0f);
  test.addInstance(3, moved);
  Light point;
  point.position = at(3, 2, 3);
  point.intensity = 2.0f * scale * scale;
  Light sun;
  sun.type = LightType::Directional;
  sun.direction = glm::normalize(Vec3(-0.3f, -1.0f, -0.2f));
  test.scene.lights = {point, sun};
  test.scene.environment.image = Image(32, 16, 3, 0.2f);
  test.scene.environment.image.setRgb(7, 3, Vec3(50.0f));
  return test;
}

namespace {

bool sameBytes(const Image& a, const Image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0;
}

std::vector<Vec3d> clipAbove(const std::vector<Vec3d>& polygon, const Vec3d& axis) {
  std::vector<Vec3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d& a = polygon[i];
    const Vec3d& b = polygon[(i + 1) % polygon.size()];
    const double da = glm::dot(a, axis), db = glm::dot(b, axis);
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

}  // namespace

bool sameBytes(const BakeResult& a, const BakeResult& b) {
  if (a.pages.size() != b.pages.size()) return false;
  for (std::size_t p = 0; p < a.pages.size(); ++p) {
    if (a.pages[p].maps.size() != b.pages[p].maps.size()) return false;
    for (std::size_t i = 0; i < a.pages[p].maps.size(); ++i)
      if (!sameBytes(a.pages[p].maps[i], b.pages[p].maps[i])) return false;
    if (!sameBytes(a.pages[p].flat, b.pages[p].flat) || !sameBytes(a.pages[p].aux, b.pages[p].aux) ||
        !sameBytes(a.pages[p].mapErrors, b.pages[p].mapErrors))
      return false;
  }
  return a.stats.rays == b.stats.rays && a.stats.shadowRays == b.stats.shadowRays &&
         a.stats.meanFlat == b.stats.meanFlat && a.stats.projectionResidual == b.stats.projectionResidual;
}

double polygonLight(const Vec3d& p, const Vec3d& normal, const Vec3d& kernelAxis, std::vector<Vec3d> corners) {
  for (Vec3d& c : corners) c -= p;
  corners = clipAbove(clipAbove(corners, normal), kernelAxis);
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d a = glm::normalize(corners[i]);
    const Vec3d b = glm::normalize(corners[(i + 1) % corners.size()]);
    const Vec3d cross = glm::cross(a, b);
    const double sine = glm::length(cross);
    if (sine < 1e-14) continue;
    sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(cross / sine, kernelAxis);
  }
  return std::abs(sum) / (2 * std::numbers::pi);
}

Vec3d axisInWorld(const TestScene& test, int page, int basis) {
  for (const Surface& s : test.atlas.surfaces) {
    if (s.page != page) continue;
    const Frame frame = frameFromTangent(s.normals[0], s.tangents[0]);
    return Vec3d(basis < 0 ? frame.n : frame.fromLocal(kRnmBasis[static_cast<std::size_t>(basis)]));
  }
  return Vec3d(0);
}

Deviation deviation(const TestScene& test, BakeOptions options, int page,
                    const std::function<Maps(const Vec3d&)>& expected) {
  options.encoding = rnmEncoding(Projection::Raw);
  const auto p = static_cast<std::size_t>(page);
  const Surface* surface = nullptr;
  for (const Surface& s : test.atlas.surfaces)
    if (s.page == page) surface = &s;
  const int n = test.atlas.pages[p].width;
  constexpr int kSub = 32;
  Deviation d;
  std::array<double, 4> sum{}, squares{};
  const Vec3d corner(surface->positions[3]);
  const Vec3d right = Vec3d(surface->positions[2]) - corner, down = Vec3d(surface->positions[0]) - corner;
  for (int y = 0; y < n * kSub; ++y)
    for (int x = 0; x < n * kSub; ++x) {
      const Maps at = expected(corner + right * ((x + 0.5) / (n * kSub)) + down * ((y + 0.5) / (n * kSub)));
      for (std::size_t m = 0; m < 4; ++m) d.expected[m] += at[m] / (n * kSub * n * kSub);
    }
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed) + 1;
    const BakeResult result = test.bake(options);
    if (result.pages.empty()) return d;
    Maps mean{};
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        for (std::size_t m = 0; m < 4; ++m) {
          const Image& image = m == 0 ? result.pages[p].flat : result.pages[p].maps[m - 1];
          mean[m] += static_cast<double>(luminance(image.rgb(x, y))) / (n * n);
        }
    for (std::size_t m = 0; m < 4; ++m) {
      sum[m] += mean[m] - d.expected[m];
      squares[m] += (mean[m] - d.expected[m]) * (mean[m] - d.expected[m]);
    }
  }
  for (std::size_t m = 0; m < 4; ++m) {
    d.mean[m] = sum[m] / kSeeds;
    const double variance = std::max(0.0, squares[m] / kSeeds - d.mean[m] * d.mean[m]) * kSeeds / (kSeeds - 1);
    d.standardError[m] = std::sqrt(variance / kSeeds);
  }
  return d;
}

void expectAgreement(const Deviation& d, double power) {
  for (std::size_t m = 0; m < 4; ++m) {
    const std::string map = m == 0 ? "flat" : "rnm" + std::to_string(m - 1);
    EXPECT_LE(std::abs(d.mean[m]), 4 * d.standardError[m] + 2e-5 * d.expected[m] + 1e-7)
        << map << ": expected " << d.expected[m] << ", standard error " << d.standardError[m];
    EXPECT_LE(d.standardError[m], power * d.expected[m] + 1e-7) << map << ": too noisy to tell";
  }
}

}  // namespace lumel::testing_scene
