// Where a scene asks for a light volume.
#pragma once

#include <string>

#include "scene/base/math.h"

namespace lumel {

/// A box in world space, from extras.lumel.volume of a node.
struct VolumeBox {
  std::string name;  // of the node
  Vec3 least{0};
  Vec3 most{0};
  float cell = 0.0f;  // metres; 0: not stated
};

}  // namespace lumel
