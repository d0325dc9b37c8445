// Heights in texels on a regular grid: the surface that occludes. Texel (x, y) is a vertex at (x, y, height), rows run
// down the image; each cell is two triangles split along x - y = constant (vertex (x, y) to (x + 1, y + 1)).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/math.h"
#include "scene/images/image_io.h"

namespace lumel::ssbump {

struct HeightField {
  int width = 0;
  int height = 0;
  bool wrap = true;           // tiles in both directions; else the surface ends at its outermost texels
  std::vector<float> texels;  // width * height, in units of a texel's width
  float lowest = 0, highest = 0;

  const float* row(int y) const {
    return texels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
  float* row(int y) { return texels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }
  /// Height at any coordinates: wrapped, or clamped to the edge.
  float at(int x, int y) const;
  void updateRange();
};

/// How a map's values become heights.
struct HeightOptions {
  std::string channel;  // a name ("A", "R"), an index, "luminance", or empty: the first
  double scale = 5;     // height of a map value of 1: in texels, or with scaleIsPercent in % of the width
  bool scaleIsPercent = true;
  bool invert = false;  // 1 - value
  bool wrap = true;
};

/// "12", "12.5" or "5%" into options. Errors: Usage.
Expected<void> parseHeightScale(const std::string& text, HeightOptions& options);

/// The index of a channel by name, index or (-1) "luminance". Errors: Input, listing the channels there are.
Expected<int> findChannel(const LoadedImage& image, const std::string& channel, const std::string& name);

/// True where the colours of most pixels are unit vectors pointing out of the surface: a normal map.
bool looksLikeNormalMap(const Image& image);

/// Errors: Input (no such channel, palette, not finite (with its place), beyond 1e6 texels, looks like a normal map and
/// no channel was chosen). Takes the pixels over to keep memory bounded.
Expected<HeightField> heightFieldFromImage(LoadedImage&& image, const HeightOptions& options, const std::string& name);

/// Unit normal of the surface at texel (x, y) by central differences, in (t, b, n): t right, b up the image.
Vec3 heightNormal(const HeightField& field, int x, int y);

}  // namespace lumel::ssbump
