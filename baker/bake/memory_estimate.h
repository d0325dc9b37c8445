// How much memory a bake takes, told in advance.
#pragma once

#include "scene/scene.h"

namespace lumel {

/// What a bake's memory depends on.
struct BakeSize {
  double maps = 0.0;  // of the encoding
  double pageTexels = 0.0;
  double coveredTexels = 0.0;
  double triangles = 0.0;      // of all instances
  double encodedBytes = 0.0;   // of images, as they are in their files
  double decodedTexels = 0.0;  // of images that shade or emit
  double skyPixels = 0.0;      // of the sky image
  double skyCells = 0.0;       // of EnvironmentLight
};

/// Triangles, images and sky of a scene, baked with the encoding that bakes have unless told otherwise; texels are left
/// at 0.
BakeSize sceneSize(const Scene& scene);

/// Peak resident memory of `lumel bake` in bytes, the program and its libraries included. baker/bake/README.md
/// has the model, tests/bench/README.md how far it was off for real scenes.
double bakeMemory(const BakeSize& size);

}  // namespace lumel
