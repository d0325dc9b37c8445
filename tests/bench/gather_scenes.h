// Scenes for the benchmarks of the gather, made of rectangular grids that share one mesh and one atlas page.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "baker/light/light_transport.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"
#include "scene/scene.h"

namespace lumel::bench_scenes {

struct GridScene {
  Scene scene;
  Atlas atlas;  // one page

  explicit GridScene(int pageSize = 1024);
  int addMaterial(const Vec3& albedo, const Vec3& emission = Vec3(0.0f));
  /// corner + x * right + y * up in `cells` x `cells` quads, facing cross(right, up), with texels x texels of the page.
  void addGrid(const Vec3& corner, const Vec3& right, const Vec3& up, int cells, int texels, int material);
  /// Six grids that face into a box, or out of it.
  void addBox(const Vec3& min, const Vec3& max, bool inwards, int cells, int texels, int material);
  std::size_t triangles() const;

 private:
  int shelfX_ = 0, shelfY_ = 0, shelfHeight_ = 0;
};

/// A hall with 60 finely meshed boxes as furniture: 349 thousand triangles.
GridScene furnishedRooms();
/// The same with 48 thousand leaf quads in the air (each leaf has two sides), 445 thousand triangles.
GridScene foliage();
/// A Cornell box, 7.5 thousand texels: a lamp at the ceiling, two blocks unless it is empty, red and green walls.
GridScene cornellBox(bool empty = false);
/// Two rooms joined by a door, a lamp in one of them.
GridScene twoRooms();

/// What a bake sets up before it gathers.
struct Transport {
  explicit Transport(const GridScene& made);

  const GridScene& made;
  std::vector<std::string> notes;
  Materials materials;
  std::unique_ptr<RayScene> rays;
  PunctualLights punctual;
  EmissiveTriangles emissive;
  EnvironmentLight environment;
  std::vector<PageTexels> texels;

  LightTransport light() const { return {*rays, materials, punctual, emissive, environment}; }
};

}  // namespace lumel::bench_scenes
