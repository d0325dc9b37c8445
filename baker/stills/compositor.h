// Stills of a baked scene as a game would show it, or one side of it (shading.h), from the bake's files alone.
// Nothing here knows how the light was computed, so it is an independent check of what was written.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "baker/stills/picture_scene.h"
#include "baker/stills/shading.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

struct RenderOptions {
  int width = 1280;
  int height = 720;
  int samplesPerPixel = 16;
  const Shading* shading = &shadings().front();
  std::vector<Light> lamps = {};  // shine beside what is baked, and cast shadows
};

struct Still {
  Image radiance;  // linear RGB; of numbers, their mean over what `lit` counts
  Image lit;       // one channel: share of the pixel that shows a lit surface; the rest is sky or shines by itself. Of
                   // numbers: the share in which they are known
};

/// What one ray sees, for choosing a viewpoint.
struct Sighting {
  bool surface = false;      // else sky
  bool behind = false;       // the first thing in the way was the back of a surface
  bool throughBack = false;  // and culled
  float distance = 0.0f;
  Vec3 normal{0, 0, 0};  // geometric, unit, towards the eye
  int primitive = -1;    // number in the scene's file order
  Vec3 radiance{0, 0, 0};
};

class Compositor {
 public:
  /// Builds the ray scene and decodes the textures that shade. `baked` must outlive the compositor.
  /// A texture that cannot be decoded is left out and named in warnings(). Errors: Failed (Embree).
  static Expected<Compositor> make(const BakedScene& baked);
  ~Compositor();
  Compositor(Compositor&&) noexcept;

  /// Colour, emission and normal maps are filtered to what a ray stands for, alpha masks are not; the light never is,
  /// or charts would run together. Back faces of single-sided materials are culled, alpha masks cut, blended surfaces
  /// mixed front to back. A primitive without lightmap that is not unlit is shown under the mean light of the bake. The
  /// same for any thread count. Errors: Interrupted.
  Expected<Still> render(const Camera& camera, const RenderOptions& options, Progress& progress) const;

  Sighting look(const Vec3& origin, const Vec3& direction) const;

  const std::vector<std::string>& warnings() const;
  bool hasSky() const;
  Vec3 meanLight() const;  // mean irradiance / pi of the bake
  Vec3 boundsMin() const;
  Vec3 boundsMax() const;

 private:
  explicit Compositor(std::unique_ptr<PictureScene> scene);
  std::unique_ptr<PictureScene> scene_;
};

}  // namespace lumel
