#include "baker/stills/compositor.h"

#include <algorithm>
#include <map>
#include <optional>

#include "scene/base/embree.h"
#include "scene/base/parallel.h"
#include "scene/images/environment.h"
#include "scene/images/texture.h"

namespace lumel {
namespace {

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

/// One primitive of one instance, in world space.
struct Shape {
  const Primitive* primitive = nullptr;
  const Material* material = nullptr;
  int number = 0;
  bool mirrored = false;
  LightmapPlace lightmap;
  std::vector<Vec3> positions;
  Mat3 normalMatrix{1.0f};
  Mat3 linear{1.0f};
};

/// A point on a shape: which triangle and where in it.
struct Hit {
  const Shape* shape = nullptr;
  std::array<std::uint32_t, 3> vertices{};
  Vec3 weights{0, 0, 0};
  float width = 0.0f;  // of the part of the surface that the ray stands for, in metres; 0: a point
};

template <class T>
T interpolate(const Hit& hit, const std::vector<T>& values) {
  return values[hit.vertices[0]] * hit.weights.x + values[hit.vertices[1]] * hit.weights.y +
         values[hit.vertices[2]] * hit.weights.z;
}

Vec2 uvAt(const Hit& hit, int set) {
  const auto& sets = hit.shape->primitive->uvSets;
  if (toSize(set) >= sets.size() || sets[toSize(set)].empty()) return {0, 0};
  return interpolate(hit, sets[toSize(set)]);
}

/// How wide `hit.width` is in a set's coordinates: a ratio of areas, so the mean of a surface's two directions.
float uvWidthAt(const Hit& hit, int set) {
  const auto& sets = hit.shape->primitive->uvSets;
  if (hit.width <= 0.0f || toSize(set) >= sets.size() || sets[toSize(set)].empty()) return 0.0f;
  const auto& [a, b, c] = hit.vertices;
  const auto& p = hit.shape->positions;
  const auto& uv = sets[toSize(set)];
  const float area = glm::length(glm::cross(p[b] - p[a], p[c] - p[a]));
  const Vec2 u = uv[b] - uv[a], v = uv[c] - uv[a];
  return area > 0.0f ? hit.width * std::sqrt(std::abs(u.x * v.y - u.y * v.x) / area) : 0.0f;
}

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

struct RayContext {
  RTCIntersectContext embree;  // first: Embree hands a pointer to it to the filter
  bool seesAll = false;        // nothing is culled or cut out
};

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

}  // namespace

struct Compositor::Impl {
  explicit Impl(const BakedScene& scene) : baked(scene) {}

  const BakedScene& baked;
  std::vector<Shape> shapes;  // by Embree's geometry number
  std::map<std::pair<int, ColorSpace>, TexturePyramid> textures;
  std::vector<std::string> warnings;
  Vec3 least{0, 0, 0};
  Vec3 most{0, 0, 0};
  EmbreeDevice device;
  EmbreeScene rays;

  void collectShapes();
  void decodeTextures();
  Expected<void> buildRays();

  Vec4 sample(const TextureRef& ref, ColorSpace space, const Hit& hit, const Vec4& otherwise) const {
    if (!ref) return otherwise;
    const auto found = textures.find({ref.image, space});
    return found == textures.end() ? otherwise
                                   : found->second.sample(ref, uvAt(hit, ref.uvSet), uvWidthAt(hit, ref.uvSet));
  }
  Vec4 baseColor(const Hit& hit) const {
    const Material& m = *hit.shape->material;
    Vec4 color = m.baseColor;
    if (m.baseColorMap) color *= sample(m.baseColorMap, ColorSpace::Srgb, hit, Vec4(Vec3(kMissingColor), 1.0f));
    if (!hit.shape->primitive->colors.empty()) color *= interpolate(hit, hit.shape->primitive->colors);
    return color;
  }
  Vec3 emission(const Hit& hit) const {
    const Material& m = *hit.shape->material;
    if (m.emission == Vec3(0.0f) || !m.emissionMap) return m.emission;
    return m.emission * Vec3(sample(m.emissionMap, ColorSpace::Srgb, hit, Vec4(0.0f)));
  }

  RTCRayHit trace(const Vec3& origin, const Vec3& direction, float tnear, bool seesAll) const;
  Hit hitAt(unsigned geometry, unsigned triangle, float u, float v) const;
  Vec3 facing(const Hit& hit) const;
  bool showsBack(const Hit& hit, const Vec3& direction) const { return glm::dot(facing(hit), direction) > 0.0f; }
  Vec3 tangentNormal(const Hit& hit) const;
  Vec3 worldNormal(const Hit& hit) const;
  Vec3 light(const Hit& hit) const;
  Vec3 radiance(const ViewRay& ray, const Shading& shading, float& lit, Sighting* sighting) const;

  class SeenHit;
  static void filter(const RTCFilterFunctionNArguments* arguments);
};

/// A hit as shadings see it.
class Compositor::Impl::SeenHit : public SeenPoint {
 public:
  SeenHit(const Impl& impl, const Hit& hit, const Vec4& base) : impl_(impl), hit_(hit), base_(base) {}
  bool isUnlit() const override { return hit_.shape->material->unlit; }
  Vec3 albedo() const override { return Vec3(base_); }
  Vec3 emission() const override { return impl_.emission(hit_); }
  Vec3 light() const override { return impl_.light(hit_); }
  Vec3 normal() const override { return impl_.worldNormal(hit_); }

 private:
  const Impl& impl_;
  const Hit& hit_;
  const Vec4 base_;
};

void Compositor::Impl::collectShapes() {
  least = Vec3(std::numeric_limits<float>::max());
  most = -least;
  int number = 0;
  for (const Instance& instance : baked.scene.instances)
    for (const Primitive& primitive : baked.scene.meshes[toSize(instance.mesh)].primitives) {
      Shape shape;
      shape.primitive = &primitive;
      shape.material = &baked.scene.materials[toSize(primitive.material)];
      shape.number = number++;
      shape.lightmap = instance.lightmap;
      shape.lightmap.page = instance.lightmapPageOf(primitive);
      if (primitive.indices.empty()) continue;
      shape.linear = Mat3(instance.worldFromObject);
      shape.mirrored = glm::determinant(shape.linear) < 0.0f;
      shape.normalMatrix = cofactorMatrix(shape.linear) * (shape.mirrored ? -1.0f : 1.0f);
      for (const Vec3& p : primitive.positions) {
        shape.positions.push_back(Vec3(instance.worldFromObject * Vec4(p, 1.0f)));
        least = glm::min(least, shape.positions.back());
        most = glm::max(most, shape.positions.back());
      }
      shapes.push_back(std::move(shape));
    }
  if (shapes.empty()) least = most = Vec3(0.0f);
}

void Compositor::Impl::decodeTextures() {
  std::vector<std::pair<int, ColorSpace>> wanted;
  const auto want = [&](const TextureRef& ref, ColorSpace space) {
    if (ref && std::find(wanted.begin(), wanted.end(), std::make_pair(ref.image, space)) == wanted.end())
      wanted.emplace_back(ref.image, space);
  };
  for (const Shape& shape : shapes) {
    const Material& m = *shape.material;
    want(m.baseColorMap, ColorSpace::Srgb);
    want(m.normalMap, ColorSpace::Linear);
    if (m.emission != Vec3(0.0f)) want(m.emissionMap, ColorSpace::Srgb);
  }
  std::vector<std::optional<Expected<TexturePyramid>>> decoded(wanted.size());
  parallelFor(wanted.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ImageSource& source = baked.scene.images[toSize(wanted[i].first)];
      if (source.encoded.empty()) continue;
      if (auto texture = Texture::decode(source, wanted[i].second); !texture)
        decoded[i] = texture.error();
      else
        decoded[i] = TexturePyramid(std::move(*texture));
    }
  });
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!decoded[i]) continue;
    if (!*decoded[i])
      warnings.push_back((*decoded[i]).error().message);
    else
      textures.emplace(wanted[i], std::move(**decoded[i]));
  }
}

Expected<void> Compositor::Impl::buildRays() {
  auto made = newEmbreeDevice();
  if (!made) return made.error();
  device = std::move(*made);
  rays = newEmbreeScene(device.get());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Shape& shape = shapes[i];
    EmbreeGeometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    // Copies: Embree reads 16 bytes from the last vertex, which a shared buffer of three floats does not have.
    void* vertices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                             shape.positions.size());
    void* indices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), shape.primitive->triangleCount());
    if (!vertices || !indices) return failure("Embree: out of memory");
    std::copy(shape.positions.begin(), shape.positions.end(), static_cast<Vec3*>(vertices));
    std::copy(shape.primitive->indices.begin(), shape.primitive->indices.end(), static_cast<std::uint32_t*>(indices));
    const Material& m = *shape.material;
    if (!m.doubleSided || m.alphaMode == AlphaMode::Mask) {
      rtcSetGeometryUserData(geometry.get(), this);
      rtcSetGeometryIntersectFilterFunction(geometry.get(), filter);
    }
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(rays.get(), geometry.get(), static_cast<unsigned>(i));
  }
  return commitScene(device.get(), rays.get(), "scene.glb");
}

RTCRayHit Compositor::Impl::trace(const Vec3& origin, const Vec3& direction, float tnear, bool seesAll) const {
  RTCRayHit query{};
  query.ray.org_x = origin.x;
  query.ray.org_y = origin.y;
  query.ray.org_z = origin.z;
  query.ray.dir_x = direction.x;
  query.ray.dir_y = direction.y;
  query.ray.dir_z = direction.z;
  query.ray.tnear = tnear;
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RayContext context{{}, seesAll};
  rtcInitIntersectContext(&context.embree);
  rtcIntersect1(rays.get(), &context.embree, &query);
  return query;
}

Hit Compositor::Impl::hitAt(unsigned geometry, unsigned triangle, float u, float v) const {
  Hit hit;
  hit.shape = &shapes[geometry];
  for (std::size_t k = 0; k < 3; ++k)
    hit.vertices[k] = hit.shape->primitive->indices[static_cast<std::size_t>(triangle) * 3 + k];
  hit.weights = {1.0f - u - v, u, v};
  return hit;
}

/// Normal of the triangle's front, not of unit length.
Vec3 Compositor::Impl::facing(const Hit& hit) const {
  const auto& p = hit.shape->positions;
  const Vec3 normal = glm::cross(p[hit.vertices[1]] - p[hit.vertices[0]], p[hit.vertices[2]] - p[hit.vertices[0]]);
  return hit.shape->mirrored ? -normal : normal;
}

/// Takes culled backs and cut-out texels out of the ray's way.
void Compositor::Impl::filter(const RTCFilterFunctionNArguments* arguments) {
  const Impl& self = *static_cast<const Impl*>(arguments->geometryUserPtr);
  if (arguments->valid[0] == 0 || reinterpret_cast<const RayContext*>(arguments->context)->seesAll) return;
  const RTCRay& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
  const RTCHit& found = *reinterpret_cast<const RTCHit*>(arguments->hit);
  const Hit hit = self.hitAt(found.geomID, found.primID, found.u, found.v);
  const Material& m = *hit.shape->material;
  if (!m.doubleSided && self.showsBack(hit, {ray.dir_x, ray.dir_y, ray.dir_z}))
    arguments->valid[0] = 0;
  else if (m.alphaMode == AlphaMode::Mask && self.baseColor(hit).w < m.alphaCutoff)
    arguments->valid[0] = 0;
}

Vec3 Compositor::Impl::tangentNormal(const Hit& hit) const {
  const Material& m = *hit.shape->material;
  if (!m.normalMap) return {0, 0, 1};
  const Vec4 texel = sample(m.normalMap, ColorSpace::Linear, hit, Vec4(0.5f, 0.5f, 1.0f, 1.0f));
  const Vec3 n = (2.0f * Vec3(texel) - 1.0f) * Vec3(m.normalScale, m.normalScale, 1.0f);
  const float length = glm::length(n);
  return length > 1e-6f ? n / length : Vec3(0, 0, 1);
}

Vec3 Compositor::Impl::worldNormal(const Hit& hit) const {
  const Primitive& primitive = *hit.shape->primitive;
  const Vec3 n = glm::normalize(hit.shape->normalMatrix * interpolate(hit, primitive.normals));
  if (primitive.tangents.empty()) return n;
  const Vec4 tangent = interpolate(hit, primitive.tangents);
  const float handedness = primitive.tangents[hit.vertices[0]].w * (hit.shape->mirrored ? -1.0f : 1.0f);
  return frameFromTangent(n, Vec4(hit.shape->linear * Vec3(tangent), handedness)).fromLocal(tangentNormal(hit));
}

Vec3 Compositor::Impl::light(const Hit& hit) const {
  const LightmapPlace& place = hit.shape->lightmap;
  if (place.page < 0) return baked.meanFlat;
  const std::vector<Image>& maps = baked.pages[toSize(place.page)];
  const Bilinear lookup(maps[0], place.apply(uvAt(hit, 1)));
  std::array<Vec3, kMostMaps> values;
  std::transform(maps.begin(), maps.end(), values.begin(), lookup);
  return baked.encoding->decode(std::span(values).first(maps.size()), tangentNormal(hit));
}

Vec3 Compositor::Impl::radiance(const ViewRay& ray, const Shading& shading, float& lit, Sighting* sighting) const {
  constexpr int kMaxLayers = 64;
  Vec3 sum(0.0f);
  float throughput = 1.0f;
  float tnear = 0.0f;
  for (int layer = 0; layer < kMaxLayers && throughput > 1e-3f; ++layer) {
    const RTCRayHit query = trace(ray.origin, ray.direction, tnear, false);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
    Hit hit = hitAt(query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v);
    const Vec3 normal = glm::normalize(facing(hit));
    const float cosine = glm::dot(normal, ray.direction);
    // Along the slope it is wider by the cosine: the mean of both ways keeps details that one of them can show.
    hit.width = (ray.width + ray.spread * query.ray.tfar) / std::sqrt(std::max(std::abs(cosine), 1e-2f));
    const Vec4 base = baseColor(hit);
    const float alpha = hit.shape->material->alphaMode == AlphaMode::Blend ? std::clamp(base.w, 0.0f, 1.0f) : 1.0f;
    sum += throughput * alpha * shading.shade(SeenHit(*this, hit, base));
    if (emission(hit) == Vec3(0.0f)) lit += throughput * alpha;
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
    sum += throughput * environmentRadiance(baked.scene.environment, ray.direction);
  return sum;
}

Compositor::Compositor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Compositor::~Compositor() = default;
Compositor::Compositor(Compositor&&) noexcept = default;

Expected<Compositor> Compositor::make(const BakedScene& baked) {
  auto impl = std::make_unique<Impl>(baked);
  impl->collectShapes();
  impl->decodeTextures();
  if (auto built = impl->buildRays(); !built) return built.error();
  return Compositor(std::move(impl));
}

const std::vector<std::string>& Compositor::warnings() const { return impl_->warnings; }
bool Compositor::hasSky() const { return !impl_->baked.scene.environment.isBlack(); }
Vec3 Compositor::meanLight() const { return impl_->baked.meanFlat; }
Vec3 Compositor::boundsMin() const { return impl_->least; }
Vec3 Compositor::boundsMax() const { return impl_->most; }

Sighting Compositor::look(const Vec3& origin, const Vec3& direction) const {
  Sighting sighting;
  float lit = 0.0f;
  sighting.radiance = impl_->radiance({origin, direction}, shadings().front(), lit, &sighting);
  const RTCRayHit first = impl_->trace(origin, direction, 0.0f, true);
  if (first.hit.geomID == RTC_INVALID_GEOMETRY_ID) return sighting;
  const Hit hit = impl_->hitAt(first.hit.geomID, first.hit.primID, first.hit.u, first.hit.v);
  sighting.behind = impl_->showsBack(hit, direction);
  sighting.throughBack = sighting.behind && !hit.shape->material->doubleSided;
  return sighting;
}

Expected<Still> Compositor::render(const Camera& camera, const RenderOptions& options, Progress& progress) const {
  Still still{Image(options.width, options.height, 3), Image(options.width, options.height, 1)};
  const float width = static_cast<float>(options.width);
  const float height = static_cast<float>(options.height);
  const float side = 2.0f / (height * std::sqrt(static_cast<float>(options.samplesPerPixel)));
  progress.begin("render", static_cast<std::uint64_t>(options.height));
  parallelFor(toSize(options.height), 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last && !progress.cancelled(); ++row) {
      const int y = static_cast<int>(row);
      for (int x = 0; x < options.width; ++x) {
        Vec3d sum(0.0);
        float lit = 0.0f;
        for (int i = 0; i < options.samplesPerPixel; ++i) {
          const Vec2 offset = pixelSample(i);
          const ViewRay ray = viewRay(camera, 2.0f * (static_cast<float>(x) + offset.x) / width - 1.0f,
                                      1.0f - 2.0f * (static_cast<float>(y) + offset.y) / height, width / height, side);
          sum += Vec3d(impl_->radiance(ray, *options.shading, lit, nullptr));
        }
        still.radiance.setRgb(x, y, Vec3(sum / static_cast<double>(options.samplesPerPixel)));
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
