// The binary half of a GLB under construction: bytes, buffer views and accessors, aligned as glTF 2.0 asks (3.6.2.4).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

class GlbBuffer {
 public:
  using Json = nlohmann::ordered_json;

  /// Vertex attributes; each returns the index of the accessor. `withBounds` adds min and max (POSITION needs them).
  int addVec2(std::span<const Vec2> values);
  int addVec3(std::span<const Vec3> values, bool withBounds = false);
  int addVec4(std::span<const Vec4> values);
  /// Triangle indices, 16 bits wide where they fit.
  int addIndices(std::span<const std::uint32_t> indices, std::size_t vertexCount);
  /// Bytes without an accessor (an encoded image); returns the index of the buffer view.
  int addBytes(std::span<const std::uint8_t> bytes);

  std::size_t size() const { return size_; }
  /// The bytes, view by view, each padded to four.
  std::vector<std::vector<std::uint8_t>> takePieces() { return std::move(pieces_); }
  const Json& bufferViews() const { return bufferViews_; }
  const Json& accessors() const { return accessors_; }

 private:
  int addView(const void* data, std::size_t size, int target);
  int addAccessor(int view, int componentType, const char* type, std::size_t count);

  // One buffer that grows would be moved, and held twice, again and again.
  std::vector<std::vector<std::uint8_t>> pieces_;
  std::size_t size_ = 0;
  Json bufferViews_ = Json::array();
  Json accessors_ = Json::array();
};

}  // namespace lumel
