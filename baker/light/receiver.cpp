#include "baker/light/receiver.h"

#include "baker/rays/ray_start.h"

namespace lumel {

Receiver receiverAt(const RayScene& rays, const Atlas& atlas, const SurfacePoint& point) {
  const Surface& surface = atlas.surfaces[point.triangle.surface];
  const std::uint32_t* corner = surface.indices.data() + std::size_t{3} * point.triangle.triangle;
  std::array<Vec3, 3> corners, normals;
  for (std::size_t i = 0; i < 3; ++i) {
    corners[i] = surface.positions[corner[i]];
    normals[i] = surface.normals[corner[i]];
  }
  const float translation = rays.translationOf(surface.instance);
  Receiver receiver{point.position, point.geometricNormal, point.frame.n,
                    offsetPoint(point.position, point.geometricNormal, corners, translation)};
  const Vec3 e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const float rounded = roundedShare(receiver.ng, e1, e2, normals);
  if (!(rounded > 0.0f)) return receiver;
  const Vec3 lift =
      rounded * liftToRound(point.position - corners[0], e1, e2, {point.barycentric.y, point.barycentric.z}, normals);
  if (isLifted(lift, receiver.ng, offsetDistance(corners, translation))) receiver.lift = lift;
  return receiver;
}

}  // namespace lumel
