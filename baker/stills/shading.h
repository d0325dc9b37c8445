// What a still shows of the surfaces in view: one entry for each word of `lumel render --mode`.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// A point of a surface that a ray of the picture meets. What a shading does not ask for is not computed.
class SeenPoint {
 public:
  virtual ~SeenPoint() = default;
  virtual bool isUnlit() const = 0;
  virtual Vec3 albedo() const = 0;
  virtual Vec3 emission() const = 0;  // radiance
  virtual Vec3 light() const = 0;     // irradiance / pi on the mapped normal, decoded from the lightmap
  virtual Vec3 normal() const = 0;    // in the world, unit length, after the normal map
};

/// What the pixels of a picture are, which says how they become 8 bits.
enum class Shown {
  Light,  // exposed and bent by the tone curve
  Color,  // encoded as sRGB alone
  Data,   // stored as it is
};

struct Shading {
  std::string_view name;   // as --mode has it
  std::string_view shows;  // for the help: "the lit scene"
  Shown shown;
  bool hasSky;  // whether the sky is seen behind the surfaces
  Vec3 (*shade)(const SeenPoint& point);
};

/// All of them; the first is the one that is used unless told otherwise.
std::span<const Shading> shadings();

/// "the lit scene, the light alone, ... or world-space normals", and the names, in the same order.
std::string describeShadings();
std::vector<std::string> shadingNames();

}  // namespace lumel
