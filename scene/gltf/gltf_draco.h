// The one door to Draco: KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/base/expected.h"

namespace lumel {

struct DracoAttribute {
  int components = 0;
  std::vector<float> values;  // components per vertex; integers as they are, not normalised
};

struct DracoMesh {
  std::size_t vertexCount = 0;
  std::vector<std::uint32_t> indices;  // three per triangle, each below vertexCount
  std::map<std::string, DracoAttribute> attributes;
};

/// Decodes the attributes with the given unique ids, by glTF name. Errors: Input, without file or place.
Expected<DracoMesh> decodeDraco(std::span<const std::uint8_t> bytes, const std::map<std::string, int>& attributeIds);

}  // namespace lumel
