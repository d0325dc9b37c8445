// Unwrapping of a scene's instances: coincident instances (the same mesh, moved, turned, or scaled a little) share one
// flattening, each has its own place later.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "lightmap/atlas/own_uvs.h"
#include "lightmap/charts/unwrap.h"
#include "scene/base/progress.h"
#include "scene/scene.h"

namespace lumel {

struct SourceTriangle {
  int primitive = 0;
  std::uint32_t triangle = 0;
};

/// Where the triangles of a soup come from: primitives follow each other whole.
class TriangleSources {
 public:
  void add(int primitive, std::size_t triangles) {
    primitives_.push_back({primitive, static_cast<std::uint32_t>(count_)});
    count_ += triangles;
  }
  std::size_t size() const { return count_; }
  SourceTriangle operator[](std::uint32_t triangle) const {
    const auto after = std::upper_bound(primitives_.begin(), primitives_.end(), triangle,
                                        [](std::uint32_t t, const SourceTriangle& p) { return t < p.triangle; });
    return {(after - 1)->primitive, triangle - (after - 1)->triangle};
  }

 private:
  std::vector<SourceTriangle> primitives_;  // with the first of the soup's triangles that is theirs
  std::size_t count_ = 0;
};

struct ObjectLayout {
  Unwrapped unwrapped;
  TriangleSources source;     // of the soup that was unwrapped
  std::optional<OwnUvs> own;  // UVs that came with the object: then the one chart is their rectangle
};

struct LayoutUse {
  int instance = 0;
  std::size_t layout = 0;
  double scale = 1.0;  // multiplies the layout's UVs to give this instance its density
};

struct ObjectLayouts {
  std::vector<ObjectLayout> layouts;
  std::vector<LayoutUse> uses;  // in the order of the instances given
};

/// Surface of the instance in square metres, times the square of its density scale: what it asks of the atlas.
double weightedArea(const Scene& scene, const Instance& instance);

/// Length of its longest edge that gets a lightmap in metres, times its density scale.
double weightedLength(const Scene& scene, const Instance& instance);

/// Charts for `instances`, but for meshes with `ownUvs` (one flag per mesh of the scene) a rectangle for the UVs that
/// they bring. Parallel over layouts. A cancelled run returns early with what it has: ask progress.cancelled().
ObjectLayouts layOutObjects(const Scene& scene, const std::vector<int>& instances, const std::vector<bool>& ownUvs,
                            double texelsPerMeter, const UnwrapOptions& options, Progress& progress);

}  // namespace lumel
