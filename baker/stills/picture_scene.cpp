#include "baker/stills/picture_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "scene/base/parallel.h"
#include "ssbump/maps/weights.h"

namespace lumel {
namespace {

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

template <class T>
T interpolate(const PictureHit& hit, const std::vector<T>& values) {
  return values[hit.vertices[0]] * hit.weights.x + values[hit.vertices[1]] * hit.weights.y +
         values[hit.vertices[2]] * hit.weights.z;
}

struct RayContext {
  RTCIntersectContext embree;  // first: Embree hands a pointer to it to the filter
  Passes passes = Passes::CutOutsAndBacks;
};

/// A number for each triangle's chart, counted on from `count`: triangles of a chart are joined by vertices.
std::vector<int> chartsOf(const Primitive& primitive, int& count) {
  std::vector<std::uint32_t> parent(primitive.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto rootOf = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3)
    for (std::size_t k = 1; k < 3; ++k) parent[rootOf(primitive.indices[i + k])] = rootOf(primitive.indices[i]);
  std::vector<int> numbers(primitive.positions.size(), -1);
  std::vector<int> charts;
  for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
    int& number = numbers[rootOf(primitive.indices[i])];
    if (number < 0) number = count++;
    charts.push_back(number);
  }
  return charts;
}

}  // namespace

Expected<std::unique_ptr<PictureScene>> PictureScene::make(const BakedScene& baked) {
  std::unique_ptr<PictureScene> scene(new PictureScene(baked));
  scene->collectShapes();
  scene->decodeTextures();
  if (auto built = scene->buildRays(); !built) return built.error();
  return scene;
}

void PictureScene::collectShapes() {
  least_ = Vec3(std::numeric_limits<float>::max());
  most_ = -least_;
  int number = 0;
  int charts = 0;
  for (const Instance& instance : baked_->scene.instances)
    for (const Primitive& primitive : baked_->scene.meshes[toSize(instance.mesh)].primitives) {
      PictureShape shape;
      shape.primitive = &primitive;
      shape.material = &baked_->scene.materials[toSize(primitive.material)];
      shape.number = number++;
      shape.lightmap = instance.lightmap;
      shape.lightmap.page = instance.lightmapPageOf(primitive);
      if (primitive.indices.empty()) continue;
      // Readers of scene.glb find the words there that a bake wrote; other words count as the usual form.
      if (const auto form = ssbump::parseConvention(shape.material->ssbumpForm))
        shape.ssbumpEncoding.convention = *form;
      if (const auto hand = ssbump::parseHand(shape.material->ssbumpHand)) shape.ssbumpEncoding.hand = *hand;
      shape.linear = Mat3(instance.worldFromObject);
      shape.mirrored = glm::determinant(shape.linear) < 0.0f;
      shape.normalMatrix = cofactorMatrix(shape.linear) * (shape.mirrored ? -1.0f : 1.0f);
      for (const Vec3& p : primitive.positions) {
        shape.positions.push_back(Vec3(instance.worldFromObject * Vec4(p, 1.0f)));
        least_ = glm::min(least_, shape.positions.back());
        most_ = glm::max(most_, shape.positions.back());
      }
      shape.charts = chartsOf(primitive, charts);
      shapes_.push_back(std::move(shape));
    }
  if (shapes_.empty()) least_ = most_ = Vec3(0.0f);
}

void PictureScene::decodeTextures() {
  std::vector<std::pair<int, ColorSpace>> wanted;
  const auto want = [&](const TextureRef& ref, ColorSpace space) {
    if (ref && std::find(wanted.begin(), wanted.end(), std::make_pair(ref.image, space)) == wanted.end())
      wanted.emplace_back(ref.image, space);
  };
  for (const PictureShape& shape : shapes_) {
    const Material& m = *shape.material;
    want(m.baseColorMap, ColorSpace::Srgb);
    want(m.normalMap, ColorSpace::Linear);
    want(m.ssbumpMap, ColorSpace::Linear);
    want(m.occlusionMap, ColorSpace::Linear);
    if (m.emission != Vec3(0.0f)) want(m.emissionMap, ColorSpace::Srgb);
  }
  std::vector<std::optional<Expected<TexturePyramid>>> decoded(wanted.size());
  parallelFor(wanted.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ImageSource& source = baked_->scene.images[toSize(wanted[i].first)];
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
      warnings_.push_back((*decoded[i]).error().message);
    else
      textures_.emplace(wanted[i], std::move(**decoded[i]));
  }
}

Expected<void> PictureScene::buildRays() {
  auto made = newEmbreeDevice();
  if (!made) return made.error();
  device_ = std::move(*made);
  rays_ = newEmbreeScene(device_.get());
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    const PictureShape& shape = shapes_[i];
    EmbreeGeometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
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
    rtcAttachGeometryByID(rays_.get(), geometry.get(), static_cast<unsigned>(i));
  }
  return commitScene(device_.get(), rays_.get(), "scene.glb");
}

RTCRayHit PictureScene::trace(const Vec3& origin, const Vec3& direction, float tnear, float tfar, Passes passes) const {
  RTCRayHit query{};
  query.ray.org_x = origin.x;
  query.ray.org_y = origin.y;
  query.ray.org_z = origin.z;
  query.ray.dir_x = direction.x;
  query.ray.dir_y = direction.y;
  query.ray.dir_z = direction.z;
  query.ray.tnear = tnear;
  query.ray.tfar = tfar;
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RayContext context{{}, passes};
  rtcInitIntersectContext(&context.embree);
  rtcIntersect1(rays_.get(), &context.embree, &query);
  return query;
}

PictureHit PictureScene::hitAt(unsigned geometry, unsigned triangle, float u, float v) const {
  PictureHit hit;
  hit.shape = &shapes_[geometry];
  for (std::size_t k = 0; k < 3; ++k)
    hit.vertices[k] = hit.shape->primitive->indices[static_cast<std::size_t>(triangle) * 3 + k];
  hit.weights = {1.0f - u - v, u, v};
  hit.triangle = triangle;
  return hit;
}

/// Normal of the triangle's front, not of unit length.
Vec3 PictureScene::facing(const PictureHit& hit) const {
  const auto& p = hit.shape->positions;
  const Vec3 normal = glm::cross(p[hit.vertices[1]] - p[hit.vertices[0]], p[hit.vertices[2]] - p[hit.vertices[0]]);
  return hit.shape->mirrored ? -normal : normal;
}

/// Takes culled backs and cut-out texels out of the ray's way.
void PictureScene::filter(const RTCFilterFunctionNArguments* arguments) {
  const PictureScene& self = *static_cast<const PictureScene*>(arguments->geometryUserPtr);
  const Passes passes = reinterpret_cast<const RayContext*>(arguments->context)->passes;
  if (arguments->valid[0] == 0 || passes == Passes::Nothing) return;
  const RTCRay& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
  const RTCHit& found = *reinterpret_cast<const RTCHit*>(arguments->hit);
  const PictureHit hit = self.hitAt(found.geomID, found.primID, found.u, found.v);
  const Material& m = *hit.shape->material;
  if (passes == Passes::CutOutsAndBacks && !m.doubleSided && self.showsBack(hit, {ray.dir_x, ray.dir_y, ray.dir_z}))
    arguments->valid[0] = 0;
  else if (m.alphaMode == AlphaMode::Mask && self.baseColor(hit).w < m.alphaCutoff)
    arguments->valid[0] = 0;
}

bool PictureScene::sees(const Vec3& from, const Vec3& to) const {
  const Vec3 way = to - from;
  const float length = glm::length(way);
  if (!(length > 0.0f)) return true;
  constexpr float kShort = 1.0f - 1e-4f;
  const float near = 1e-4f * (1.0f + glm::length(from)) / length;
  return trace(from, way / length, near * length, kShort * length, Passes::CutOuts).hit.geomID ==
         RTC_INVALID_GEOMETRY_ID;
}

Vec3 PictureScene::positionAt(const PictureHit& hit) const { return interpolate(hit, hit.shape->positions); }

Vec2 PictureScene::uvAt(const PictureHit& hit, int set) const {
  const auto& sets = hit.shape->primitive->uvSets;
  if (toSize(set) >= sets.size() || sets[toSize(set)].empty()) return {0, 0};
  return interpolate(hit, sets[toSize(set)]);
}

float PictureScene::uvScaleAt(const PictureHit& hit, int set) const {
  const auto& sets = hit.shape->primitive->uvSets;
  if (toSize(set) >= sets.size() || sets[toSize(set)].empty()) return 0.0f;
  const auto& [a, b, c] = hit.vertices;
  const auto& p = hit.shape->positions;
  const auto& uv = sets[toSize(set)];
  const float area = glm::length(glm::cross(p[b] - p[a], p[c] - p[a]));
  const Vec2 u = uv[b] - uv[a], v = uv[c] - uv[a];
  return area > 0.0f ? std::sqrt(std::abs(u.x * v.y - u.y * v.x) / area) : 0.0f;
}

Vec4 PictureScene::sample(const TextureRef& ref, ColorSpace space, const PictureHit& hit, const Vec4& otherwise) const {
  if (!ref) return otherwise;
  const auto found = textures_.find({ref.image, space});
  if (found == textures_.end()) return otherwise;
  const float width = hit.width > 0.0f ? hit.width * uvScaleAt(hit, ref.uvSet) : 0.0f;
  return found->second.sample(ref, uvAt(hit, ref.uvSet), width);
}

Vec4 PictureScene::baseColor(const PictureHit& hit) const {
  const Material& m = *hit.shape->material;
  Vec4 color = m.baseColor;
  if (m.baseColorMap) color *= sample(m.baseColorMap, ColorSpace::Srgb, hit, Vec4(Vec3(kMissingColor), 1.0f));
  if (!hit.shape->primitive->colors.empty()) color *= interpolate(hit, hit.shape->primitive->colors);
  return color;
}

Vec3 PictureScene::emission(const PictureHit& hit) const {
  const Material& m = *hit.shape->material;
  if (m.emission == Vec3(0.0f) || !m.emissionMap) return m.emission;
  return m.emission * Vec3(sample(m.emissionMap, ColorSpace::Srgb, hit, Vec4(0.0f)));
}

float PictureScene::occlusion(const PictureHit& hit) const {
  const Material& m = *hit.shape->material;
  return 1.0f + m.occlusionStrength * (sample(m.occlusionMap, ColorSpace::Linear, hit, Vec4(1.0f)).x - 1.0f);
}

Vec3 PictureScene::ssbump(const PictureHit& hit) const {
  const Material& m = *hit.shape->material;
  const Vec4 texel = sample(m.ssbumpMap, ColorSpace::Linear, hit, Vec4(1.0f / 3.0f));
  return ssbump::convert(Vec3(texel), hit.shape->ssbumpEncoding, ssbump::Encoding{});
}

Vec3 PictureScene::tangentNormal(const PictureHit& hit) const {
  const Material& m = *hit.shape->material;
  if (!m.normalMap) return m.ssbumpMap ? ssbump::recoveredNormal(ssbump(hit)) : Vec3(0, 0, 1);
  const Vec4 texel = sample(m.normalMap, ColorSpace::Linear, hit, Vec4(0.5f, 0.5f, 1.0f, 1.0f));
  const Vec3 n = (2.0f * Vec3(texel) - 1.0f) * Vec3(m.normalScale, m.normalScale, 1.0f);
  const float length = glm::length(n);
  return length > 1e-6f ? n / length : Vec3(0, 0, 1);
}

Frame PictureScene::frame(const PictureHit& hit) const {
  const Primitive& primitive = *hit.shape->primitive;
  const Vec3 n = glm::normalize(hit.shape->normalMatrix * interpolate(hit, primitive.normals));
  if (primitive.tangents.empty()) return frameAround(n);
  const Vec4 tangent = interpolate(hit, primitive.tangents);
  const float handedness = primitive.tangents[hit.vertices[0]].w * (hit.shape->mirrored ? -1.0f : 1.0f);
  return frameFromTangent(n, Vec4(hit.shape->linear * Vec3(tangent), handedness));
}

}  // namespace lumel
