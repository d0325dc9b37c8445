#include "tests/bench/gather_scenes.h"

#include "scene/base/check.h"
#include "scene/base/sobol.h"

namespace lumel::bench_scenes {
namespace {

/// Numbers in [0, 1) that are the same everywhere.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : seed_(seed) {}
  float operator()() { return unitFloat(hashCombine(seed_, count_++)); }

 private:
  std::uint32_t seed_;
  std::uint32_t count_ = 0;
};

}  // namespace

GridScene::GridScene(int pageSize) {
  atlas.pages.push_back({pageSize, pageSize});
  scene.meshes.emplace_back();
  scene.instances.emplace_back();
  scene.instances.back().mesh = 0;
}

int GridScene::addMaterial(const Vec3& albedo, const Vec3& emission) {
  Material m;
  m.baseColor = Vec4(albedo, 1.0f);
  m.emission = emission;
  scene.materials.push_back(m);
  Primitive primitive;
  primitive.material = static_cast<int>(scene.materials.size()) - 1;
  scene.meshes[0].primitives.push_back(primitive);
  Surface surface;
  surface.primitive = primitive.material;
  atlas.surfaces.push_back(surface);
  return primitive.material;
}

void GridScene::addGrid(const Vec3& corner, const Vec3& right, const Vec3& up, int cells, int texels, int material) {
  Primitive& primitive = scene.meshes[0].primitives[static_cast<std::size_t>(material)];
  Surface& surface = atlas.surfaces[static_cast<std::size_t>(material)];
  const Page& page = atlas.pages[0];
  if (shelfX_ + texels > page.width) {
    shelfY_ += shelfHeight_;
    shelfX_ = shelfHeight_ = 0;
  }
  const Vec2 place(shelfX_, shelfY_);
  shelfX_ += texels + 1;
  shelfHeight_ = std::max(shelfHeight_, texels + 1);
  LUMEL_CHECK(shelfY_ + texels <= page.height);

  const auto chart = static_cast<std::uint32_t>(atlas.charts.size());
  atlas.charts.push_back({material, 1.0f});
  const auto first = static_cast<std::uint32_t>(primitive.positions.size());
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) {
      const Vec2 at = Vec2(x, y) / static_cast<float>(cells);
      primitive.positions.push_back(corner + at.x * right + at.y * up);
      primitive.normals.push_back(glm::normalize(glm::cross(right, up)));
      surface.positions.push_back(primitive.positions.back());
      surface.normals.push_back(primitive.normals.back());
      surface.tangents.emplace_back(glm::normalize(right), 1.0f);
      surface.lightmapUvs.push_back((place + static_cast<float>(texels) * Vec2(at.x, 1.0f - at.y)) /
                                    Vec2(page.width, page.height));
      surface.sourceVertex.push_back(static_cast<std::uint32_t>(surface.sourceVertex.size()));
    }
  const auto row = static_cast<std::uint32_t>(cells) + 1;
  for (std::uint32_t y = 0; y < row - 1; ++y)
    for (std::uint32_t x = 0; x < row - 1; ++x) {
      const std::uint32_t a = first + y * row + x;
      for (const std::uint32_t v : {a, a + 1, a + row + 1, a, a + row + 1, a + row}) {
        primitive.indices.push_back(v);
        surface.indices.push_back(v);
      }
      for (int i = 0; i < 2; ++i) {
        surface.sourceTriangle.push_back(static_cast<std::uint32_t>(surface.sourceTriangle.size()));
        surface.charts.push_back(chart);
      }
    }
}

void GridScene::addBox(const Vec3& min, const Vec3& max, bool inwards, int cells, int texels, int material) {
  const Vec3 x(max.x - min.x, 0, 0), y(0, max.y - min.y, 0), z(0, 0, max.z - min.z);
  const auto add = [&](const Vec3& corner, const Vec3& a, const Vec3& b) {
    addGrid(corner, inwards ? a : b, inwards ? b : a, cells, texels, material);
  };
  add(min, z, x);
  add(max, -x, -z);
  add(min, y, z);
  add(max, -z, -y);
  add(min, x, y);
  add(max, -y, -x);
}

std::size_t GridScene::triangles() const {
  std::size_t count = 0;
  for (const Primitive& primitive : scene.meshes[0].primitives) count += primitive.triangleCount();
  return count;
}

GridScene furnishedRooms() {
  GridScene made;
  const int wall = made.addMaterial(Vec3(0.7f));
  const int wood = made.addMaterial({0.5f, 0.4f, 0.3f});
  made.addBox({0, 0, 0}, {12, 3.2f, 9}, true, 8, 120, wall);
  Dice dice(5);
  for (int i = 0; i < 60; ++i) {
    // Each in a cell of its own, a little off the floor: no box reaches into another.
    const Vec3 size(0.3f + 0.8f * dice(), 0.3f + 1.4f * dice(), 0.3f + 1.0f * dice());
    const Vec3 cell(1.2f * static_cast<float>(i % 10), 0, 1.5f * static_cast<float>(i / 10));
    const Vec3 at = cell + Vec3(0.02f + (1.16f - size.x) * dice(), 0.05f, 0.02f + (1.46f - size.z) * dice());
    made.addBox(at, at + size, false, 22, 20, wood);
  }
  return made;
}

GridScene foliage() {
  GridScene made = furnishedRooms();
  const int leaf = made.addMaterial({0.2f, 0.5f, 0.1f});
  Dice dice(6);
  for (int i = 0; i < 24000; ++i) {
    const Vec3 at(0.1f + 11.8f * dice(), 1.9f + 1.2f * dice(), 0.1f + 8.8f * dice());  // above the boxes
    const float z = 2 * dice() - 1;
    const float turn = 2 * kPi * dice();
    const float r = std::sqrt(1 - z * z);
    const Frame frame = frameAround({r * std::cos(turn), r * std::sin(turn), z});
    const Vec3 a = 0.05f * frame.t, b = 0.08f * frame.b;
    made.addGrid(at, a, b, 1, 2, leaf);
    made.addGrid(at - 1e-4f * frame.n, b, a, 1, 2, leaf);
  }
  return made;
}

GridScene cornellBox(bool empty) {
  GridScene made(128);
  const int white = made.addMaterial(Vec3(0.73f, 0.73f, 0.73f));
  const int red = made.addMaterial({0.63f, 0.06f, 0.05f});
  const int green = made.addMaterial({0.12f, 0.45f, 0.09f});
  const int lamp = made.addMaterial(Vec3(0.0f), {17, 12, 4});
  constexpr int kWall = 36;
  made.addGrid({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 1, kWall, white);
  made.addGrid({1, 1, 1}, {-1, 0, 0}, {0, 0, -1}, 1, kWall, white);
  made.addGrid({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1, kWall, white);
  made.addGrid({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, kWall, red);
  made.addGrid({1, 1, 1}, {0, 0, -1}, {0, -1, 0}, 1, kWall, green);
  made.addGrid({0.4f, 0.995f, 0.4f}, {0.2f, 0, 0}, {0, 0, 0.2f}, 1, 4, lamp);
  if (empty) return made;
  const auto block = [&](const Vec3& size, const Vec3& at, float turn) {
    const float c = std::cos(turn), s = std::sin(turn);
    const Vec3 x = size.x * Vec3(c, 0, -s), z = size.z * Vec3(s, 0, c), y(0, size.y, 0);
    made.addGrid(at + y, z, x, 1, 10, white);
    made.addGrid(at, y, x, 1, 10, white);
    made.addGrid(at, z, y, 1, 10, white);
    made.addGrid(at + z, x, y, 1, 10, white);
    made.addGrid(at + x, y, z, 1, 10, white);
  };
  block({0.3f, 0.6f, 0.3f}, {0.15f, 0, 0.25f}, 0.3f);
  block({0.3f, 0.3f, 0.3f}, {0.55f, 0, 0.55f}, -0.3f);
  return made;
}

GridScene twoRooms() {
  GridScene made(160);
  const int white = made.addMaterial(Vec3(0.7f));
  const int lamp = made.addMaterial(Vec3(0.0f), Vec3(20));
  constexpr float kDepth = 3, kHeight = 2.5f, kThick = 0.2f, kDoor = 0.9f, kDoorHeight = 2;
  for (const float x0 : {0.0f, 4 + kThick}) {
    const Vec3 a(x0, 0, 0), x(4, 0, 0), y(0, kHeight, 0), z(0, 0, kDepth);
    made.addGrid(a, z, x, 1, 32, white);
    made.addGrid(a + x + y + z, -x, -z, 1, 32, white);
    made.addGrid(a, x, y, 1, 32, white);
    made.addGrid(a + x + y + z, -y, -x, 1, 32, white);
    if (x0 == 0.0f)
      made.addGrid(a, y, z, 1, 32, white);
    else
      made.addGrid(a + x + y + z, -z, -y, 1, 32, white);
  }
  const float left = (kDepth - kDoor) / 2, right = left + kDoor;
  // The wall with the door: its two sides in three parts each, then the frame of the door.
  for (const bool first : {true, false}) {
    const float x = first ? 4.0f : 4 + kThick;
    const auto wall = [&](const Vec3& corner, const Vec3& along, const Vec3& up, int texels) {
      made.addGrid(corner, first ? along : up, first ? up : along, 1, texels, white);
    };
    wall({x, 0, 0}, {0, 0, left}, {0, kHeight, 0}, 20);
    wall({x, 0, right}, {0, 0, left}, {0, kHeight, 0}, 20);
    wall({x, kDoorHeight, left}, {0, 0, kDoor}, {0, kHeight - kDoorHeight, 0}, 10);
  }
  made.addGrid({4, 0, left}, {0, 0, kDoor}, {kThick, 0, 0}, 1, 8, white);
  made.addGrid({4, kDoorHeight, left}, {kThick, 0, 0}, {0, 0, kDoor}, 1, 8, white);
  made.addGrid({4, 0, left}, {kThick, 0, 0}, {0, kDoorHeight, 0}, 1, 8, white);
  made.addGrid({4, 0, right}, {0, kDoorHeight, 0}, {kThick, 0, 0}, 1, 8, white);
  made.addGrid({0.5f, 2.4f, 1.2f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1, 4, lamp);
  return made;
}

Transport::Transport(const GridScene& from) : made(from), materials(from.scene, true, notes) {
  auto built = RayScene::build(made.scene, materials);
  LUMEL_CHECK(bool(built));
  rays = *std::move(built);
  emissive = EmissiveTriangles(*rays, materials);
  texels = findTexels(made.atlas);
}

}  // namespace lumel::bench_scenes
