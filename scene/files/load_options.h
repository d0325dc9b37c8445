// What a load may reach.
#pragma once

namespace lumel {

struct LoadOptions {
  bool allowOutsidePaths = false;  // buffers and images outside the scene's folder
};

}  // namespace lumel
