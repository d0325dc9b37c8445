#include "baker/memory_estimate.h"

#include <algorithm>
#include <set>

#include "scene/image_io.h"

namespace lumel {
namespace {

/// The program with its libraries, and what every bake keeps for its threads.
constexpr double kBase = 145e6;

// The gather warms up its cache with links that are gone when it samples; the pages are made when its cache is gone.
constexpr double kWarmUpPerCovered = 150.0;  // coordinates 16, cache 28, links and light 100, waves
constexpr double kResultPerCovered = 95.0;   // coordinates 16, sums 71, waves and probes
constexpr double kLookupPerPageTexel = 4.0;
constexpr double kImagesPerPageTexel = 64.0;  // three RNM maps, the flat one and aux, in floats

/// The scene, its surfaces, Embree's triangles and tree, and where each triangle lies on its page.
constexpr double kPerTriangle = 350.0;
constexpr double kPerDecodedTexel = 4.0;

}  // namespace

BakeSize sceneSize(const Scene& scene) {
  BakeSize size;
  for (const Instance& instance : scene.instances)
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      size.triangles += static_cast<double>(primitive.triangleCount());
  for (const ImageSource& image : scene.images) size.encodedBytes += static_cast<double>(image.encoded.size());
  std::set<int> shading;
  for (const Material& m : scene.materials) {
    if (m.baseColorMap) shading.insert(m.baseColorMap.image);
    if (m.emissionMap) shading.insert(m.emissionMap.image);
  }
  for (const int i : shading) {
    if (i < 0 || static_cast<std::size_t>(i) >= scene.images.size()) continue;
    const auto [width, height] = imageSize(scene.images[static_cast<std::size_t>(i)].encoded);
    size.decodedTexels += static_cast<double>(width) * height;
  }
  return size;
}

double bakeMemory(const BakeSize& size) {
  const double warmUp = kWarmUpPerCovered * size.coveredTexels + kLookupPerPageTexel * size.pageTexels;
  const double result = kResultPerCovered * size.coveredTexels + kImagesPerPageTexel * size.pageTexels;
  // scene.glb holds the encoded images once more, while it is written.
  return kBase + 2 * size.encodedBytes + kPerDecodedTexel * size.decodedTexels + kPerTriangle * size.triangles +
         std::max(warmUp, result);
}

}  // namespace lumel
