// Small scenes made of rectangles for the baker's tests, each rectangle with a page of its own, and closed forms.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "baker/bake/bake.h"
#include "scene/images/image_io.h"

namespace lumel::testing_scene {

struct RectangleOptions {
  int material = 0;
  int texels = 4;  // on a side of its page; 0: it gets no lightmap
  bool casts = true;
  bool flip = false;  // mirrored by its instance: same place and front, negative determinant
};

/// A scene and the atlas for it.
struct TestScene {
  Scene scene;
  Atlas atlas;
  Integrator integrator = Integrator::Path;  // what tryBake uses, whatever its options say

  TestScene() { scene.materials.emplace_back(); }
  int addMaterial(const Vec3& albedo, const Vec3& emission = Vec3(0.0f));
  /// An RGBA picture, rows from the top; read with NEAREST.
  int addImage(int width, int height, const std::vector<Vec4>& pixels);

  /// The rectangle corner, corner + right, corner + right + up, corner + up; its front faces cross(right, up).
  /// Texture and lightmap have `right` to the right and `up` upwards; so has the bake frame. Returns its page, or -1.
  int addRectangle(const Vec3& corner, const Vec3& right, const Vec3& up, const RectangleOptions& options = {});
  /// Six rectangles that face into the box.
  void addRoom(const Vec3& min, const Vec3& max, const RectangleOptions& options = {});
  /// Places the mesh of an instance once more.
  void addInstance(int instance, const Mat4& worldFromObject, bool receives = false);

  Expected<BakeResult> tryBake(const BakeOptions& options, int threads = 0) const;
  /// The same, and a failed bake fails the test.
  BakeResult bake(const BakeOptions& options, int threads = 0) const;
};

/// Whether two bakes have the same images, rays and figures to the bit.
bool sameBytes(const BakeResult& a, const BakeResult& b);

/// A room with every kind of light, a cut-out and instances.
TestScene busyRoom(float scale = 1.0f, const Vec3& offset = Vec3(0.0f));

/// Irradiance / pi on a surface of a polygon of radiance 1, by Lambert's formula, weighed by max(0, w.kernelAxis) over
/// the hemisphere above `normal`: the polygon is clipped by both horizons. Corners in any order round it.
double polygonLight(const Vec3d& p, const Vec3d& normal, const Vec3d& kernelAxis, std::vector<Vec3d> corners);

/// Flat and the three raw maps: irradiance / pi of grey light.
using Maps = std::array<double, 4>;

/// The mean over a page's texels of (baked - expected), for several independent seeds.
struct Deviation {
  Maps mean{};           // over seeds
  Maps standardError{};  // of that mean, from the spread between seeds
  Maps expected{};       // mean over the page
};

/// Bakes with kSeeds seeds (raw projection) and compares with closed forms: expected(p) for a world point p of the
/// page's rectangle, averaged over each texel by midpoints.
inline constexpr int kSeeds = 8;
Deviation deviation(const TestScene& test, BakeOptions options, int page,
                    const std::function<Maps(const Vec3d&)>& expected);

/// Fails where a mean is further from its expectation than 4 standard errors (7 degrees of freedom: 0.5% by chance)
/// and 2e-5 of it (float rounding), or where the standard error is above `power` of the expectation: then the test
/// could not tell.
void expectAgreement(const Deviation& d, double power = 0.01);

/// RNM basis vector `basis` (or the normal: -1) of the page's rectangle in the world.
Vec3d axisInWorld(const TestScene& test, int page, int basis);

}  // namespace lumel::testing_scene
