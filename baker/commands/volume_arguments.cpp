#include "baker/commands/volume_arguments.h"

#include <cstdio>
#include <limits>

namespace lumel {
namespace {

/// A point takes some 600 bytes.
constexpr double kMostPoints = 4e6;

/// The box of all that is seen; nothing for an empty scene.
std::optional<VolumeBox> boxAround(const Scene& scene) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  VolumeBox box{.name = "", .least = Vec3(kInfinity), .most = Vec3(-kInfinity)};
  for (const Instance& instance : scene.instances)
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      for (const Vec3& position : primitive.positions) {
        const Vec3 p(instance.worldFromObject * Vec4(position, 1.0f));
        box.least = glm::min(box.least, p);
        box.most = glm::max(box.most, p);
      }
  if (!(box.least.x <= box.most.x)) return std::nullopt;
  return box;
}

Expected<LightVolume> gridOf(const VolumeBox& box, float cell) {
  if (box.cell > 0.0f) cell = box.cell;
  if (const double points = pointCount(box.least, box.most, cell); points > kMostPoints) {
    char text[200];
    std::snprintf(text, sizeof text, "%.3g points with cells of %g m, a light volume may have %.3g; give wider cells",
                  points, static_cast<double>(cell), kMostPoints);
    return usageError((box.name.empty() ? "--cell" : "volume '" + box.name + "'") + ": " + text);
  }
  LightVolume volume = volumeOf(box.least, box.most, cell);
  volume.name = box.name;
  return volume;
}

}  // namespace

void declareVolumes(OptionTable& options, VolumeArguments& a) {
  options.group("Light volumes");
  options.box("volume", a.box,
              "Also find the light at the points of a grid in this box, for what moves: metres in the scene, two "
              "opposite corners. Nodes with extras.lumel.volume have theirs without it");
  options.flag("volume-auto", a.everywhere, "A volume around the whole scene");
  options.number("cell", a.cell, {1e-6f, 1e18f}, "Most metres from point to point").placeholder = "METERS";
  options.integer("volume-samples", a.samples, {1, 1 << 20}, "Rays per point of light volumes");
}

Expected<std::vector<LightVolume>> volumesOf(const VolumeArguments& a, const Scene& scene) {
  std::vector<VolumeBox> boxes;
  if (a.box)
    boxes.push_back(
        {.name = "", .least = glm::min((*a.box)[0], (*a.box)[1]), .most = glm::max((*a.box)[0], (*a.box)[1])});
  if (a.everywhere)
    if (auto box = boxAround(scene)) boxes.push_back(*std::move(box));
  boxes.insert(boxes.end(), scene.volumes.begin(), scene.volumes.end());
  std::vector<LightVolume> volumes;
  for (const VolumeBox& box : boxes) {
    auto volume = gridOf(box, a.cell);
    if (!volume) return volume.error();
    volumes.push_back(*std::move(volume));
  }
  return volumes;
}

}  // namespace lumel
