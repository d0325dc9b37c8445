#include "baker/stills/compositor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "baker/stills/seen_hit.h"
#include "scene/base/parallel.h"
#include "scene/images/environment.h"

namespace lumel {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// A ray and how wide the cone about it is (Amanatides 1984): `width` at its origin, and `spread` more per metre.
struct ViewRay {
  Vec3 origin;
  Vec3 direction;
  float width = 0.0f;
  float spread = 0.0f;
};

/// Through (x, y) in -1..1, y up, of a picture; it stands for a square `side` wide, where the picture is 2 high.
ViewRay viewRay(const Camera& camera, float x, float y, float aspect, float side) {
  const Mat3 turn(glm::normalize(Vec3(camera.worldFromCamera[0])), glm::normalize(Vec3(camera.worldFromCamera[1])),
                  glm::normalize(Vec3(camera.worldFromCamera[2])));
  const Vec3 origin(camera.worldFromCamera[3]);
  if (camera.orthographic)
    return {origin + turn * Vec3(x * aspect * camera.yExtent, y * camera.yExtent, 0.0f), turn * Vec3(0, 0, -1),
            side * camera.yExtent, 0.0f};
  const float tangent = std::tan(0.5f * camera.yFov);
  return {origin, glm::normalize(turn * Vec3(x * aspect * tangent, y * tangent, -1.0f)), 0.0f, side * tangent};
}

/// Point i of the R2 sequence (Roberts 2018): even coverage of the pixel for any number of points.
Vec2 pixelSample(int i) {
  const double n = static_cast<double>(i);
  const double x = 0.5 + 0.7548776662466927 * n;
  const double y = 0.5 + 0.5698402909980532 * n;
  return {static_cast<float>(x - std::floor(x)), static_cast<float>(y - std::floor(y))};
}

/// What a ray brings to the eye. `lit` grows by the share of it that shows lit surfaces or, of numbers, known ones.
Vec3 radiance(const PictureScene& scene, const ViewRay& ray, const Shading& shading, std::span<const Light> lamps,
              float& lit, Sighting* sighting) {
  constexpr int kMaxLayers = 64;
  Vec3 sum(0.0f);
  float throughput = 1.0f;
  float tnear = 0.0f;
  for (int layer = 0; layer < kMaxLayers && throughput > 1e-3f; ++layer) {
    const RTCRayHit query = scene.trace(ray.origin, ray.direction, tnear, kFar, Passes::CutOutsAndBacks);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
    PictureHit hit = scene.hitAt(query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v);
    const Vec3 normal = glm::normalize(scene.facing(hit));
    const float cosine = glm::dot(normal, ray.direction);
    // Along the slope it is wider by the cosine: the mean of both ways keeps details that one of them can show.
    hit.width = (ray.width + ray.spread * query.ray.tfar) / std::sqrt(std::max(std::abs(cosine), 1e-2f));
    const Vec4 base = scene.baseColor(hit);
    const float alpha = hit.shape->material->alphaMode == AlphaMode::Blend ? std::clamp(base.w, 0.0f, 1.0f) : 1.0f;
    const Vec3 shown = shading.shade(SeenHit(scene, hit, base, ray.direction, lamps));
    const bool isNumber = shading.shown == Shown::Number;
    if (!isNumber || std::isfinite(shown.x)) {
      sum += throughput * alpha * shown;
      if (isNumber || scene.emission(hit) == Vec3(0.0f)) lit += throughput * alpha;
    }
    throughput *= 1.0f - alpha;
    if (sighting && !sighting->surface && alpha > 0.5f) {
      sighting->surface = true;
      sighting->distance = query.ray.tfar;
      sighting->primitive = hit.shape->number;
      sighting->normal = cosine > 0.0f ? -normal : normal;
    }
    tnear = query.ray.tfar * (1.0f + 1e-5f);
  }
  if (throughput > 1e-3f && shading.hasSky)
    sum += throughput * environmentRadiance(scene.baked().scene.environment, ray.direction);
  return sum;
}

}  // namespace

Compositor::Compositor(std::unique_ptr<PictureScene> scene) : scene_(std::move(scene)) {}
Compositor::~Compositor() = default;
Compositor::Compositor(Compositor&&) noexcept = default;

Expected<Compositor> Compositor::make(const BakedScene& baked) {
  auto scene = PictureScene::make(baked);
  if (!scene) return scene.error();
  return Compositor(*std::move(scene));
}

const std::vector<std::string>& Compositor::warnings() const { return scene_->warnings(); }
bool Compositor::hasSky() const { return !scene_->baked().scene.environment.isBlack(); }
Vec3 Compositor::meanLight() const { return scene_->baked().meanFlat; }
Vec3 Compositor::boundsMin() const { return scene_->least(); }
Vec3 Compositor::boundsMax() const { return scene_->most(); }

Sighting Compositor::look(const Vec3& origin, const Vec3& direction) const {
  Sighting sighting;
  float lit = 0.0f;
  sighting.radiance = lumel::radiance(*scene_, {origin, direction}, shadings().front(), {}, lit, &sighting);
  const RTCRayHit first = scene_->trace(origin, direction, 0.0f, kFar, Passes::Nothing);
  if (first.hit.geomID == RTC_INVALID_GEOMETRY_ID) return sighting;
  const PictureHit hit = scene_->hitAt(first.hit.geomID, first.hit.primID, first.hit.u, first.hit.v);
  sighting.behind = scene_->showsBack(hit, direction);
  sighting.throughBack = sighting.behind && !hit.shape->material->doubleSided;
  return sighting;
}

Expected<Still> Compositor::render(const Camera& camera, const RenderOptions& options, Progress& progress) const {
  Still still{Image(options.width, options.height, 3), Image(options.width, options.height, 1)};
  const float width = static_cast<float>(options.width);
  const float height = static_cast<float>(options.height);
  const float side = 2.0f / (height * std::sqrt(static_cast<float>(options.samplesPerPixel)));
  progress.begin("render", static_cast<std::uint64_t>(options.height));
  parallelFor(static_cast<std::size_t>(options.height), 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last && !progress.cancelled(); ++row) {
      const int y = static_cast<int>(row);
      for (int x = 0; x < options.width; ++x) {
        Vec3d sum(0.0);
        float lit = 0.0f;
        for (int i = 0; i < options.samplesPerPixel; ++i) {
          const Vec2 offset = pixelSample(i);
          const ViewRay ray = viewRay(camera, 2.0f * (static_cast<float>(x) + offset.x) / width - 1.0f,
                                      1.0f - 2.0f * (static_cast<float>(y) + offset.y) / height, width / height, side);
          sum += Vec3d(radiance(*scene_, ray, *options.shading, options.lamps, lit, nullptr));
        }
        const bool isNumber = options.shading->shown == Shown::Number;
        const double share =
            isNumber ? std::max(static_cast<double>(lit), 1e-6) : static_cast<double>(options.samplesPerPixel);
        still.radiance.setRgb(x, y, Vec3(sum / share));
        still.lit.at(x, y)[0] = lit / static_cast<float>(options.samplesPerPixel);
      }
      progress.advance(1);
    }
  });
  progress.end();
  if (progress.cancelled()) return interrupted();
  return still;
}

}  // namespace lumel
