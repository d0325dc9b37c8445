#include "baker/stills/seen_hit.h"

#include <algorithm>
#include <limits>

#include "baker/stills/lamps.h"
#include "scene/images/environment.h"

namespace lumel {
namespace {

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

/// Bilinear lookup as a graphics card does it: texel centres at half integers, the border repeated.
struct Bilinear {
  int x0, y0, x1, y1;
  float fx, fy;

  Bilinear(const Image& image, Vec2 uv) {
    const auto place = [](float coordinate, int size, int& low, int& high, float& fraction) {
      const float t = std::clamp(coordinate * static_cast<float>(size) - 0.5f, 0.0f, static_cast<float>(size - 1));
      low = std::min(static_cast<int>(t), size - 1);
      high = std::min(low + 1, size - 1);
      fraction = t - static_cast<float>(low);
    };
    place(uv.x, image.width, x0, x1, fx);
    place(uv.y, image.height, y0, y1, fy);
  }
  Vec3 operator()(const Image& image) const {
    return glm::mix(glm::mix(image.rgb(x0, y0), image.rgb(x1, y0), fx),
                    glm::mix(image.rgb(x0, y1), image.rgb(x1, y1), fx), fy);
  }
};

}  // namespace

SeenHit::SeenHit(const PictureScene& scene, const PictureHit& hit, const Vec4& baseColor, const Vec3& direction,
                 std::span<const Light> lamps)
    : scene_(scene), hit_(hit), baseColor_(baseColor), direction_(direction), lampsOfPicture_(lamps) {}

float SeenHit::occlusion() const {
  if (hit_.shape->material->occlusionMap || !hasSsbump()) return scene_.occlusion(hit_);
  const Vec3 s = ssbump();
  return s.x + s.y + s.z;
}

bool SeenHit::hasRnm() const { return scene_.baked().encoding->name() == "rnm"; }

Vec3 SeenHit::lookup(const Image& image) const { return Bilinear(image, lightmapUv())(image); }

/// The light on a unit normal in the world, of the first light volume around the point; without one the bake's mean.
Vec3 SeenHit::around(const Vec3& normal) const {
  const BakedScene& baked = scene_.baked();
  const Vec3 position = scene_.positionAt(hit_);
  for (const LightVolume& volume : baked.volumes)
    if (volume.contains(position))
      return lightOn(volume, lookUp(volume, position, frame().n, VolumeMask::Sight), normal, VolumeBasis::Sh2);
  return baked.meanFlat;
}

Vec3 SeenHit::map(std::size_t index) const {
  const BakedScene& baked = scene_.baked();
  if (page() < 0) return around(frame().n);
  const std::vector<Image>& maps = baked.pages[toSize(page())];
  return index < maps.size() ? lookup(maps[index]) : Vec3(0.0f);
}

Vec3 SeenHit::flat() const {
  const BakedScene& baked = scene_.baked();
  return page() < 0 ? around(frame().n) : lookup(baked.flat[toSize(page())]);
}

Vec3 SeenHit::decoded(const Vec3& normalTangent) const {
  const BakedScene& baked = scene_.baked();
  if (page() < 0) return around(frame().fromLocal(normalTangent));
  const std::vector<Image>& maps = baked.pages[toSize(page())];
  const Bilinear at(maps[0], lightmapUv());
  std::array<Vec3, kMostMaps> values;
  std::transform(maps.begin(), maps.end(), values.begin(), at);
  return baked.encoding->decode(std::span(values).first(maps.size()), normalTangent);
}

std::span<const LampLight> SeenHit::lamps() const {
  if (lamps_) return *lamps_;
  lamps_.emplace();
  const Vec3 position = scene_.positionAt(hit_);
  for (const Light& lamp : lampsOfPicture_) {
    LampLight light;
    const bool far = lamp.type == LightType::Directional;
    const float reach = glm::length(scene_.most() - scene_.least());
    const Vec3 from = far ? position - (1.0f + reach) * lamp.direction : lamp.position;
    light.toLamp = glm::normalize(from - position);
    light.irradiance = lampIrradiance(lamp, position);
    if (light.irradiance != Vec3(0.0f) && scene_.sees(position, from)) lamps_->push_back(light);
  }
  return *lamps_;
}

Vec3 SeenHit::sky(const Vec3& direction) const {
  return environmentRadiance(scene_.baked().scene.environment, direction);
}

Vec2 SeenHit::texel() const {
  if (page() < 0) return Vec2(0.0f);
  const Image& map = scene_.baked().pages[toSize(page())].front();
  return lightmapUv() * Vec2(static_cast<float>(map.width), static_cast<float>(map.height));
}

float SeenHit::aux(std::string_view channel) const {
  const BakedScene& baked = scene_.baked();
  const auto found = std::ranges::find(baked.auxChannels, channel);
  if (page() < 0 || found == baked.auxChannels.end()) return std::numeric_limits<float>::quiet_NaN();
  const Image& image = baked.aux[toSize(page())];
  const Vec2 at = texel();
  return image.at(std::clamp(static_cast<int>(at.x), 0, image.width - 1),
                  std::clamp(static_cast<int>(at.y), 0, image.height - 1))[found - baked.auxChannels.begin()];
}

float SeenHit::density() const {
  if (page() < 0) return 0.0f;
  const Image& map = scene_.baked().pages[toSize(page())].front();
  const Vec2 scale = hit_.shape->lightmap.scale * Vec2(static_cast<float>(map.width), static_cast<float>(map.height));
  return scene_.uvScaleAt(hit_, 1) * std::sqrt(std::abs(scale.x * scale.y));
}

}  // namespace lumel
