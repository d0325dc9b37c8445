#include "baker/bake/memory_estimate.h"

#include <algorithm>
#include <set>

#include "baker/bake/bake_options.h"
#include "baker/light/environment_light.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

/// The program with its libraries, and what every bake keeps for its threads.
constexpr double kBase = 145e6;

// Bytes per covered texel and per texel of the pages, and what is resident then.
// Sampling: places 16, the flat map's sums 12, reflectance 8, cache 8, counts 22, errors 13, light of places 4,
// figures of waves 14; the map from pages to texels. The warm-up before it takes less: its links are 32.
constexpr double kSamplingPerCovered = 97.0;
constexpr double kSamplingPerPageTexel = 0.5;
// Finishing: places; the flat and the aux image 28, what the denoiser knows of texels and its strips 13, charts and
// masks.
constexpr double kFinishingPerCovered = 16.0;
constexpr double kFinishingPerPageTexel = 48.0;
// A map of the encoding: its sums, and then its image; how far its mean moves, and then its error.
constexpr double kPerMap = 12.0;
constexpr double kErrorPerMap = 4.0;

// Bytes per triangle. Charts: the scene 24 and more, half-edges 31, the tree of merges 8; of one chart its mesh 34,
// places and their moves 16, factor and what belongs to it 78. Sampling: the scene and its surfaces
// 90, Embree's tree and corners 70, where each triangle lies on its page 32. Then Embree is gone; scene.glb comes last.
constexpr double kChartsPerTriangle = 195.0;
constexpr double kSamplingPerTriangle = 200.0;
constexpr double kFinishingPerTriangle = 150.0;
constexpr double kPerDecodedTexel = 4.0;
constexpr double kPerSkyPixel = 12.0;
constexpr double kPerSkyCell = 18.0;

}  // namespace

BakeSize sceneSize(const Scene& scene) {
  BakeSize size;
  size.maps = static_cast<double>(BakeOptions{}.encoding->mapCount());
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
  if (!scene.environment.isBlack()) {
    const Image& sky = scene.environment.image;
    size.skyPixels = static_cast<double>(sky.width) * sky.height;
    size.skyCells = static_cast<double>(EnvironmentLight::cellCount(sky));
  }
  return size;
}

double bakeMemory(const BakeSize& size) {
  const double charts = kChartsPerTriangle * size.triangles;
  const double sampling = kSamplingPerTriangle * size.triangles + kPerDecodedTexel * size.decodedTexels +
                          (kSamplingPerCovered + (kPerMap + kErrorPerMap) * size.maps) * size.coveredTexels +
                          kSamplingPerPageTexel * size.pageTexels + kPerSkyCell * size.skyCells;
  // scene.glb holds the encoded images once more, while it is written.
  const double finishing = size.encodedBytes + kFinishingPerTriangle * size.triangles +
                           kFinishingPerCovered * size.coveredTexels +
                           (kFinishingPerPageTexel + (kPerMap + kErrorPerMap) * size.maps) * size.pageTexels;
  return kBase + size.encodedBytes + kPerSkyPixel * size.skyPixels + std::max({charts, sampling, finishing});
}

}  // namespace lumel
