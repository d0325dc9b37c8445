#include "baker/export/page_geometry.h"

#include <algorithm>
#include <array>
#include <map>

#include "lightmap/maps/dilate.h"
#include "lightmap/raster.h"
#include "scene/base/union_find.h"

namespace lumel {
namespace {

/// A texel that is covered by aux but that no triangle touches, by rounding: a chart of its own kind.
constexpr std::uint32_t kUnknownChart = 0xffffffffu;
/// What a texel that saw the backs of things counts beside valid ones: it speaks only where they are silent.
constexpr float kInvalidShare = 1e-4f;

/// Calls visit(instance, primitive) for each primitive on a page.
template <class Visit>
void forEachPrimitive(const Scene& scene, std::size_t page, Visit&& visit) {
  for (const Instance& instance : scene.instances)
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      if (instance.lightmapPageOf(primitive) == static_cast<int>(page)) visit(instance, primitive);
}

/// The corners of a triangle on its page, in texels.
std::array<Vec2d, 3> cornersOf(const Instance& instance, const Primitive& primitive, std::size_t triangle,
                               const Vec2d& size) {
  std::array<Vec2d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = snapToTexelBorder(
        Vec2d(instance.lightmap.apply(primitive.uvSets[1][primitive.indices[3 * triangle + k]])) * size);
  return corners;
}

/// Gives the triangles of a primitive the number of the chart that they are part of.
class ChartNumbers {
 public:
  std::vector<std::uint32_t> of(const Instance& instance, const Primitive& primitive) {
    if (&instance != object_) byUv_.clear();
    object_ = &instance;
    const std::size_t count = primitive.triangleCount();
    std::vector<std::uint32_t> numbers(count);
    for (std::size_t t = 0; t < count; ++t) {
      numbers[t] = static_cast<std::uint32_t>(parent_.size());
      parent_.push_back(numbers[t]);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto key = bitsOf(primitive.uvSets[1][primitive.indices[3 * t + k]]);
        const auto [known, isNew] = byUv_.emplace(key, numbers[t]);
        if (!isNew) unite(parent_, known->second, numbers[t]);
      }
    }
    return numbers;
  }
  std::uint32_t chartOf(std::uint32_t number) { return findRoot(parent_, number) + 1; }

 private:
  const Instance* object_ = nullptr;
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> byUv_;  // of the object so far: a triangle with such a corner
  std::vector<std::uint32_t> parent_;
};

std::vector<std::uint32_t> chartsOnPage(const BakedScene& baked, std::size_t page, int width, int height) {
  struct Part {
    const Instance* instance;
    const Primitive* primitive;
    std::vector<std::uint32_t> numbers;
  };
  ChartNumbers numbers;
  std::vector<Part> parts;
  forEachPrimitive(baked.scene, page, [&](const Instance& instance, const Primitive& primitive) {
    parts.push_back({&instance, &primitive, numbers.of(instance, primitive)});
  });
  std::vector<std::uint32_t> charts(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  for (const Part& part : parts)
    for (std::size_t t = 0; t < part.numbers.size(); ++t)
      forEachTexelSpan(cornersOf(*part.instance, *part.primitive, t, Vec2d(width, height)), {0, 0, width, height}, 0.0,
                       [&](int y, int x0, int x1) {
                         const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
                         for (int x = x0; x < x1; ++x)
                           charts[row + static_cast<std::size_t>(x)] = numbers.chartOf(part.numbers[t]);
                       });
  return charts;
}

/// The point of a triangle that is nearest to p, as weights of its corners; near enough for triangles of a texel's
/// size: the point's own weights, clamped.
std::array<double, 3> weightsAt(const std::array<Vec2d, 3>& corners, const Vec2d& p, bool& isInside) {
  const double area = signedArea(corners[0], corners[1], corners[2]);
  std::array<double, 3> w = {signedArea(p, corners[1], corners[2]) / area, signedArea(corners[0], p, corners[2]) / area,
                             signedArea(corners[0], corners[1], p) / area};
  isInside = w[0] >= 0 && w[1] >= 0 && w[2] >= 0;
  double sum = 0;
  for (double& x : w) sum += (x = std::max(x, 0.0));
  for (double& x : w) x /= sum;
  return w;
}

/// The bake frame at a point of a triangle, in the world.
Frame frameAt(const Instance& instance, const Primitive& primitive, std::size_t triangle,
              const std::array<double, 3>& weights) {
  const Mat3 linear(instance.worldFromObject);
  const bool isMirrored = glm::determinant(linear) < 0.0f;
  Vec3 n(0.0f);
  Vec4 tangent(0.0f);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t vertex = primitive.indices[3 * triangle + k];
    n += static_cast<float>(weights[k]) * primitive.normals[vertex];
    if (!primitive.tangents.empty()) tangent += static_cast<float>(weights[k]) * primitive.tangents[vertex];
  }
  n = cofactorMatrix(linear) * n;
  n = glm::normalize(isMirrored ? -n : n);
  if (primitive.tangents.empty()) return frameAround(n);
  const float hand = primitive.tangents[primitive.indices[3 * triangle]].w * (isMirrored ? -1.0f : 1.0f);
  return frameFromTangent(n, Vec4(linear * Vec3(tangent), hand));
}

}  // namespace

/// By how many texels the bake's maps were dilated.
static int dilatedRings(const nlohmann::ordered_json& bakeJson) {
  const auto settings = bakeJson.find("settings");
  if (settings == bakeJson.end() || !settings->is_object()) return 0;
  const auto rings = settings->find("dilate");
  if (rings == settings->end() || !rings->is_number_integer()) return 0;
  return static_cast<int>(std::clamp<std::int64_t>(rings->get<std::int64_t>(), 0, 1024));
}

std::vector<ChartTexels> chartTexels(const BakedScene& baked, const nlohmann::ordered_json& bakeJson) {
  const int rings = dilatedRings(bakeJson);
  const auto channelOf = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(baked.auxChannels, name) - baked.auxChannels.begin());
  };
  const std::size_t coverage = channelOf("coverage"), validity = channelOf("validity");
  std::vector<ChartTexels> pages;
  for (std::size_t page = 0; page < baked.aux.size(); ++page) {
    const Image& aux = baked.aux[page];
    ChartTexels texels{aux.width, aux.height, chartsOnPage(baked, page, aux.width, aux.height), {}, {}};
    texels.weights.resize(texels.charts.size());
    for (std::size_t i = 0; i < texels.charts.size(); ++i) {
      const float* values = aux.pixels.data() + i * static_cast<std::size_t>(aux.channels);
      texels.weights[i] = values[coverage] * (values[validity] < 0.5f ? kInvalidShare : 1.0f);
      if (!(texels.weights[i] > 0.0f)) texels.charts[i] = 0;
      if (texels.weights[i] > 0.0f && texels.charts[i] == 0) texels.charts[i] = kUnknownChart;
    }
    TexelMask mask{aux.width, aux.height, {}};
    for (const std::uint32_t chart : texels.charts) mask.known.push_back(chart != 0);
    Image nothing(aux.width, aux.height, 1);
    dilate(nothing, mask, rings);
    texels.kept = std::move(mask.known);
    pages.push_back(std::move(texels));
  }
  return pages;
}

PageFrames pageFrames(const BakedScene& baked, std::size_t page) {
  const Image& flat = baked.flat[page];
  const int width = flat.width, height = flat.height;
  PageFrames found;
  found.frames.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  found.isKnown.assign(found.frames.size(), 0);
  std::vector<std::uint8_t> isMiddle(found.frames.size(), 0);
  forEachPrimitive(baked.scene, page, [&](const Instance& instance, const Primitive& primitive) {
    for (std::size_t t = 0; t < primitive.triangleCount(); ++t) {
      const std::array<Vec2d, 3> corners = cornersOf(instance, primitive, t, Vec2d(width, height));
      forEachTexelSpan(corners, {0, 0, width, height}, 0.0, [&](int y, int x0, int x1) {
        for (int x = x0; x < x1; ++x) {
          const std::size_t at =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          bool isInside = false;
          const auto weights = weightsAt(corners, Vec2d(x + 0.5, y + 0.5), isInside);
          if (found.isKnown[at] != 0 && !(isInside && isMiddle[at] == 0)) continue;
          found.frames[at] = frameAt(instance, primitive, t, weights);
          found.isKnown[at] = 1;
          isMiddle[at] = isInside;
        }
      });
    }
  });
  return found;
}

}  // namespace lumel
