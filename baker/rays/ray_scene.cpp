#include "baker/rays/ray_scene.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include "lightmap/texels/vertex_normal.h"
#include "scene/base/check.h"
#include "scene/base/sobol.h"

namespace lumel {
namespace {

float maxAbs(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

template <class T>
T* embreeBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t count) {
  return static_cast<T*>(rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), count));
}

/// What filters may write to, behind what Embree knows of it.
struct TraceContext {
  RTCIntersectContext embree;
  std::uint32_t tinted = 0;     // bits of lanes that passed through a surface that gives light a colour
  Vec3Lanes* passed = nullptr;  // products of these colours, where wanted

  TraceContext() { rtcInitIntersectContext(&embree); }
};

/// A number in [0, 1) from a ray's bits and the triangle: the same for every thread and every order of work.
float rayHash(RTCRayN* ray, unsigned int rays, unsigned int lane, std::uint32_t geometry, std::uint32_t triangle) {
  std::uint32_t h = hashCombine(geometry, triangle);
  for (const float f : {RTCRayN_org_x(ray, rays, lane), RTCRayN_org_y(ray, rays, lane), RTCRayN_org_z(ray, rays, lane),
                        RTCRayN_dir_x(ray, rays, lane), RTCRayN_dir_y(ray, rays, lane), RTCRayN_dir_z(ray, rays, lane)})
    h = hashCombine(h, std::bit_cast<std::uint32_t>(f));
  return unitFloat(h);
}

/// Sets the fields that are the same for all rays.
void initRays(RTCRay16& ray) {
  std::fill(std::begin(ray.tnear), std::end(ray.tnear), 0.0f);
  std::fill(std::begin(ray.time), std::end(ray.time), 0.0f);
  std::fill(std::begin(ray.mask), std::end(ray.mask), 0xffffffffu);
  std::iota(std::begin(ray.id), std::end(ray.id), 0u);  // filters tell lanes by it
  std::fill(std::begin(ray.flags), std::end(ray.flags), 0u);
}

void setRay(RTCRay16& ray, int lane, const Vec3& origin, const Vec3& dir, float length) {
  ray.org_x[lane] = origin.x;
  ray.org_y[lane] = origin.y;
  ray.org_z[lane] = origin.z;
  ray.dir_x[lane] = dir.x;
  ray.dir_y[lane] = dir.y;
  ray.dir_z[lane] = dir.z;
  ray.tfar[lane] = length;
}

}  // namespace

RayPacket::RayPacket() {
  initRays(rayhit.ray);
  clear();
}

void RayPacket::clear() { std::fill(std::begin(valid), std::end(valid), 0); }

void RayPacket::set(int lane, const Vec3& origin, const Vec3& dir) {
  setRay(rayhit.ray, lane, origin, dir, std::numeric_limits<float>::infinity());
  rayhit.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  valid[lane] = -1;
}

Vec3Lanes RayPacket::directions() const {
  Vec3Lanes lanes;
  std::copy(std::begin(rayhit.ray.dir_x), std::end(rayhit.ray.dir_x), lanes.x);
  std::copy(std::begin(rayhit.ray.dir_y), std::end(rayhit.ray.dir_y), lanes.y);
  std::copy(std::begin(rayhit.ray.dir_z), std::end(rayhit.ray.dir_z), lanes.z);
  return lanes;
}

ShadowPacket::ShadowPacket() {
  initRays(ray);
  clear();
}

void ShadowPacket::clear() {
  std::fill(std::begin(valid), std::end(valid), 0);
  any = false;
}

void ShadowPacket::set(int lane, const Vec3& origin, const Vec3& dir, float length) {
  setRay(ray, lane, origin, dir, length);
  valid[lane] = -1;
  any = true;
}

Expected<std::unique_ptr<RayScene>> RayScene::build(const Scene& scene, const Materials& materials,
                                                    std::size_t mostFlattened) {
  std::unique_ptr<RayScene> rays(new RayScene(scene, materials));
  if (auto built = rays->buildGeometry(mostFlattened); !built) return built.error();
  return rays;
}

Expected<void> RayScene::buildGeometry(std::size_t mostFlattened) {
  auto device = newEmbreeDevice();
  if (!device) return device.error();
  device_ = *std::move(device);
  top_ = newEmbreeScene(device_.get());
  meshScenes_.resize(scene_->meshes.size());

  std::vector<int> uses(scene_->meshes.size(), 0);
  std::size_t placedTriangles = 0;
  for (const Instance& instance : scene_->instances) {
    if (!instance.settings.casts) continue;
    ++uses[static_cast<std::size_t>(instance.mesh)];
    for (const Primitive& primitive : scene_->meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      placedTriangles += primitive.triangleCount();
  }

  for (std::size_t i = 0; i < scene_->instances.size(); ++i) {
    const Instance& instance = scene_->instances[i];
    if (!instance.settings.casts) continue;
    const std::uint32_t firstPart = addParts(static_cast<int>(i));
    if (firstPart == parts_.size()) continue;
    // Embree inverts the transform of what it places itself; what is flat has no inverse.
    const bool invertible = std::isnormal(glm::determinant(Mat3(instance.worldFromObject)));
    const bool once = uses[static_cast<std::size_t>(instance.mesh)] == 1;
    if (once || placedTriangles <= mostFlattened || !invertible) {
      for (std::uint32_t p = firstPart; p < parts_.size(); ++p) {
        auto geometry = triangles(*parts_[p].primitive, &instance.worldFromObject, &parts_[p].positions);
        if (!geometry) return failure("ray tracing: out of memory for the triangles of '" + instance.name + "'");
        parts_[p].isWorld = true;
        rtcAttachGeometry(top_.get(), geometry.get());
        partOfGeometry_.push_back(p);
      }
      continue;
    }
    const auto shared = meshScene(instance.mesh);
    if (!shared) return shared.error();
    for (std::uint32_t p = firstPart; p < parts_.size(); ++p) parts_[p].translation = translationOf(parts_[p].instance);
    EmbreeGeometry placed(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(placed.get(), *shared);
    rtcSetGeometryTransform(placed.get(), 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &instance.worldFromObject);
    rtcCommitGeometry(placed.get());
    rtcAttachGeometry(top_.get(), placed.get());
    partOfGeometry_.push_back(firstPart);
  }
  if (auto committed = commitScene(device_.get(), top_.get(), "building the ray tracing structure"); !committed)
    return committed.error();
  if (!parts_.empty()) {
    RTCBounds bounds;
    rtcGetSceneBounds(top_.get(), &bounds);
    boundsMin_ = {bounds.lower_x, bounds.lower_y, bounds.lower_z};
    boundsMax_ = {bounds.upper_x, bounds.upper_y, bounds.upper_z};
  }
  return {};
}

std::uint32_t RayScene::addParts(int instanceIndex) {
  const Instance& instance = scene_->instances[static_cast<std::size_t>(instanceIndex)];
  const auto first = static_cast<std::uint32_t>(parts_.size());
  for (const Primitive& primitive : scene_->meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (materials_->invisible(primitive)) continue;
    ScenePart part;
    part.indices = primitive.indices.data();
    part.positions = primitive.positions.data();
    part.normals = primitive.normals.empty() ? nullptr : primitive.normals.data();
    part.doubleSided = materials_->material(primitive.material).doubleSided;
    if (materials_->hasOneAlbedo(primitive)) part.albedo = materials_->albedo({&primitive});
    part.primitive = &primitive;
    part.instance = instanceIndex;
    part.worldFromObject = instance.worldFromObject;
    part.frontSign = glm::determinant(Mat3(instance.worldFromObject)) < 0 ? -1.0f : 1.0f;
    part.worldFromNormal = cofactorMatrix(Mat3(instance.worldFromObject)) * part.frontSign;
    parts_.push_back(std::move(part));
  }
  return first;
}

EmbreeGeometry RayScene::triangles(const Primitive& primitive, const Mat4* worldFromObject, const Vec3** vertices) {
  EmbreeGeometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  auto* positions =
      embreeBuffer<Vec3>(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, primitive.positions.size());
  if (!positions) return nullptr;
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, primitive.indices.data(), 0,
                             3 * sizeof(std::uint32_t), primitive.triangleCount());
  for (std::size_t i = 0; i < primitive.positions.size(); ++i)
    positions[i] =
        worldFromObject ? Vec3(*worldFromObject * Vec4(primitive.positions[i], 1.0f)) : primitive.positions[i];
  if (vertices) *vertices = positions;
  if (materials_->needsAlphaTest(primitive)) {
    alphaTested_.push_back(
        std::make_unique<AlphaTested>(AlphaTested{materials_, &primitive, materials_->transmits(primitive)}));
    tints_ = tints_ || materials_->transmits(primitive);
    rtcSetGeometryUserData(geometry.get(), alphaTested_.back().get());
    rtcSetGeometryIntersectFilterFunction(geometry.get(), &RayScene::alphaFilter);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), &RayScene::alphaFilter);
  }
  rtcCommitGeometry(geometry.get());
  return geometry;
}

Expected<RTCScene> RayScene::meshScene(int mesh) {
  EmbreeScene& shared = meshScenes_[static_cast<std::size_t>(mesh)];
  if (shared) return shared.get();
  shared = newEmbreeScene(device_.get());
  const Mesh& source = scene_->meshes[static_cast<std::size_t>(mesh)];
  for (const Primitive& primitive : source.primitives) {
    if (materials_->invisible(primitive)) continue;
    auto geometry = triangles(primitive, nullptr, nullptr);
    if (!geometry) return failure("ray tracing: out of memory for the triangles of mesh '" + source.name + "'");
    rtcAttachGeometry(shared.get(), geometry.get());
  }
  if (auto committed = commitScene(device_.get(), shared.get(), "mesh '" + source.name + "'"); !committed)
    return committed.error();
  return shared.get();
}

void RayScene::alphaFilter(const RTCFilterFunctionNArguments* args) {
  const auto& tested = *static_cast<const AlphaTested*>(args->geometryUserPtr);
  for (unsigned int lane = 0; lane < args->N; ++lane) {
    if (args->valid[lane] != -1) continue;
    const std::uint32_t triangle = RTCHitN_primID(args->hit, args->N, lane);
    const TrianglePoint point{
        tested.primitive, triangle, {RTCHitN_u(args->hit, args->N, lane), RTCHitN_v(args->hit, args->N, lane)}};
    const Vec3 passing = tested.transmits ? tested.materials->transmittance(point) : Vec3(0.0f);
    const float share = std::max({passing.x, passing.y, passing.z});
    const float opacity = tested.transmits ? 1.0f - share : tested.materials->opacity(point);
    if (opacity >= 1.0f) continue;
    const std::uint32_t geometry = RTCHitN_geomID(args->hit, args->N, lane);
    if (opacity > 0.0f && rayHash(args->ray, args->N, lane, geometry, triangle) < opacity) continue;
    args->valid[lane] = 0;
    if (!tested.transmits) continue;
    // `share` of the rays pass, so each brings passing / share of the light.
    auto& context = *reinterpret_cast<TraceContext*>(args->context);
    const std::size_t ray = RTCRayN_id(args->ray, args->N, lane);
    context.tinted |= 1u << ray;
    if (context.passed != nullptr) context.passed->set(ray, (*context.passed)[ray] * (passing / share));
  }
}

void RayScene::intersect(RayPacket& rays, TraceMode mode) const {
  TraceContext context;
  if (mode == TraceMode::Coherent) context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  if (mode != TraceMode::Single) {
    rtcIntersect16(rays.valid, top_.get(), &context.embree, &rays.rayhit);
  } else {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!rays.valid[lane]) continue;
      RTCRayHit one;
      one.ray = rtcGetRayFromRayN(reinterpret_cast<RTCRayN*>(&rays.rayhit.ray), kLanes, static_cast<unsigned>(lane));
      one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(top_.get(), &context.embree, &one);
      rays.rayhit.ray.tfar[lane] = one.ray.tfar;
      rays.rayhit.hit.u[lane] = one.hit.u;
      rays.rayhit.hit.v[lane] = one.hit.v;
      rays.rayhit.hit.primID[lane] = one.hit.primID;
      rays.rayhit.hit.geomID[lane] = one.hit.geomID;
      rays.rayhit.hit.instID[0][lane] = one.hit.instID[0];
    }
  }
  rays.tinted = context.tinted;
  if (rays.tinted != 0) findTints(rays);
}

/// Embree finds candidates for the closest hit in any order, so what was passed on the way is known only afterwards:
/// the same ray, whose choices at surfaces are the same, is sent once more as far as to its hit.
void RayScene::findTints(RayPacket& rays) const {
  constexpr float kBeforeHit = 1.0f - 0x1p-21f;
  RTCRay16 again = rays.rayhit.ray;
  alignas(64) int valid[kLanes] = {};
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((rays.tinted >> lane & 1u) == 0) continue;
    valid[lane] = -1;
    again.tfar[lane] *= kBeforeHit;
    rays.passed.set(lane, Vec3(1.0f));
  }
  TraceContext context;
  context.passed = &rays.passed;
  rtcOccluded16(valid, top_.get(), &context.embree, &again);
}

void RayScene::occluded(ShadowPacket& rays, TraceMode mode) const {
  rays.tinted = 0;
  if (!rays.any) return;
  LUMEL_CHECK(mode != TraceMode::Coherent);
  TraceContext context;
  if (tints_) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) rays.passed.set(lane, Vec3(1.0f));
    context.passed = &rays.passed;
  }
  if (mode != TraceMode::Single) {
    rtcOccluded16(rays.valid, top_.get(), &context.embree, &rays.ray);
  } else {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!rays.valid[lane]) continue;
      RTCRay one = rtcGetRayFromRayN(reinterpret_cast<RTCRayN*>(&rays.ray), kLanes, static_cast<unsigned>(lane));
      rtcOccluded1(top_.get(), &context.embree, &one);
      rays.ray.tfar[lane] = one.tfar;
    }
  }
  rays.tinted = context.tinted;
}

float RayScene::translationOf(int instance) const {
  const Instance& placed = scene_->instances[static_cast<std::size_t>(instance)];
  const bool byEmbree = placed.settings.casts && meshScenes_[static_cast<std::size_t>(placed.mesh)];
  return byEmbree ? maxAbs(Vec3(placed.worldFromObject[3])) : 0.0f;
}

/// Returns a vertex in world space.
static Vec3 corner(const ScenePart& part, std::uint32_t vertex) {
  const Vec3& position = part.positions[vertex];
  return part.isWorld ? position : Vec3(part.worldFromObject * Vec4(position, 1.0f));
}

std::array<Vec3, 3> RayScene::corners(const ScenePart& part, std::uint32_t triangle) const {
  const std::uint32_t* index = part.indices + std::size_t{3} * triangle;
  return {corner(part, index[0]), corner(part, index[1]), corner(part, index[2])};
}

void RayScene::prefetchCorners(std::uint32_t partIndex, std::uint32_t triangle) const {
  const ScenePart& part = parts_[partIndex];
  const std::uint32_t* index = part.indices + std::size_t{3} * triangle;
  for (std::size_t i = 0; i < 3; ++i) {
    __builtin_prefetch(part.positions + index[i]);
    if (part.normals) __builtin_prefetch(part.normals + index[i]);
  }
}

void RayScene::cornersAt(const RayPacket& rays, int lane, HitCorners& hit) const {
  hit.part = partOf(rays, lane);
  const ScenePart& part = parts_[hit.part];
  const std::uint32_t* index = part.indices + std::size_t{3} * rays.rayhit.hit.primID[lane];
  for (std::size_t i = 0; i < 3; ++i) {
    hit.corners[i] = corner(part, index[i]);
    hit.normals[i] = part.normals ? part.normals[index[i]] : Vec3(0.0f);
  }
  hit.weights = {rays.rayhit.hit.u[lane], rays.rayhit.hit.v[lane]};
  hit.dir = rays.direction(lane);
}

void RayScene::set(HitCornerLanes& lanes, std::size_t lane, const HitCorners& hit) const {
  const ScenePart& part = parts_[hit.part];
  lanes.active[lane] = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    lanes.corners[i].set(lane, hit.corners[i]);
    lanes.normals[i].set(lane, hit.normals[i]);
    lanes.worldFromNormal[i].set(lane, part.worldFromNormal[static_cast<int>(i)]);
  }
  lanes.dir.set(lane, hit.dir);
  lanes.u[lane] = hit.weights.x;
  lanes.v[lane] = hit.weights.y;
  lanes.frontSign[lane] = part.frontSign;
  lanes.translation[lane] = part.translation;
}

LUMEL_FOR_EACH_CPU void receiveAt(const HitCornerLanes& hits, Vec3Lanes& p, Vec3Lanes& ng, Vec3Lanes& ns,
                                  Vec3Lanes& rayStart) {
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool active = hits.active[lane] != 0;
    const std::array<Vec3, 3> corners = {hits.corners[0][lane], hits.corners[1][lane], hits.corners[2][lane]};
    const float u = hits.u[lane], v = hits.v[lane];
    const Vec3 e1 = corners[1] - corners[0];
    const Vec3 e2 = corners[2] - corners[0];
    const Vec3 at = corners[0] + u * e1 + v * e2;
    const Vec3 front = glm::normalize(glm::cross(e1, e2) * hits.frontSign[lane]);
    const Vec3 facing = pick(glm::dot(hits.dir[lane], front) > 0.0f, -front, front);
    const Vec3 own = (1.0f - u - v) * hits.normals[0][lane] + u * hits.normals[1][lane] + v * hits.normals[2][lane];
    const Vec3 n = hits.worldFromNormal[0][lane] * own.x + hits.worldFromNormal[1][lane] * own.y +
                   hits.worldFromNormal[2][lane] * own.z;
    const Vec3 unit = unitNormalOr(n, facing, 0.0f);
    const Vec3 turned = pick(glm::dot(unit, facing) < 0.0f, -unit, unit);
    const Vec3 start = offsetPoint(at, facing, corners, hits.translation[lane]);
    p.set(lane, pick(active, at, Vec3(0.0f)));
    ng.set(lane, pick(active, facing, Vec3(0.0f)));
    ns.set(lane, pick(active, turned, Vec3(0.0f)));
    rayStart.set(lane, pick(active, start, Vec3(0.0f)));
  }
}

HitSurface RayScene::surfaceAt(const RayPacket& rays, int lane) const {
  const RTCHit16& hit = rays.rayhit.hit;
  HitSurface surface;
  surface.part = partOf(rays, lane);
  const ScenePart& part = parts_[surface.part];
  surface.material = part.primitive->material;
  surface.point = pointAt(rays, lane);
  surface.corners = corners(part, hit.primID[lane]);
  const Vec3 e1 = surface.corners[1] - surface.corners[0];
  const Vec3 e2 = surface.corners[2] - surface.corners[0];
  surface.p = surface.corners[0] + hit.u[lane] * e1 + hit.v[lane] * e2;
  const Vec3 front = glm::cross(e1, e2) * part.frontSign;
  const Vec3 dir(rays.rayhit.ray.dir_x[lane], rays.rayhit.ray.dir_y[lane], rays.rayhit.ray.dir_z[lane]);
  surface.ng = glm::normalize(front);
  surface.backFace = glm::dot(dir, surface.ng) > 0.0f;
  if (surface.backFace) surface.ng = -surface.ng;
  return surface;
}

Vec3 RayScene::shadingNormal(const HitSurface& hit) const {
  const ScenePart& part = parts_[hit.part];
  if (!part.normals) return hit.ng;
  const std::uint32_t* index = part.indices + std::size_t{3} * hit.point.triangle;
  const Vec2 b = hit.point.barycentric;
  const Vec3 n = part.worldFromNormal * ((1.0f - b.x - b.y) * part.normals[index[0]] + b.x * part.normals[index[1]] +
                                         b.y * part.normals[index[2]]);
  // The instance may have shrunk them: every length counts.
  const Vec3 unit = unitNormalOr(n, hit.ng, 0.0f);
  return glm::dot(unit, hit.ng) < 0.0f ? -unit : unit;
}

}  // namespace lumel
