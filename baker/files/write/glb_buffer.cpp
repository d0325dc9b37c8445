#include "baker/files/write/glb_buffer.h"

#include <algorithm>
#include <cstring>

namespace lumel {
namespace {

// Constants of the glTF 2.0 specification (they are OpenGL's).
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNoTarget = 0;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;

}  // namespace

int GlbBuffer::addView(const void* data, std::size_t size, int target) {
  Json view = {{"buffer", 0}, {"byteOffset", size_}, {"byteLength", size}};
  if (target != kNoTarget) view["target"] = target;
  std::vector<std::uint8_t>& piece = pieces_.emplace_back((size + 3) / 4 * 4, std::uint8_t{0});
  if (size > 0) std::memcpy(piece.data(), data, size);
  size_ += piece.size();
  bufferViews_.push_back(std::move(view));
  return static_cast<int>(bufferViews_.size()) - 1;
}

int GlbBuffer::addAccessor(int view, int componentType, const char* type, std::size_t count) {
  accessors_.push_back({{"bufferView", view}, {"componentType", componentType}, {"count", count}, {"type", type}});
  return static_cast<int>(accessors_.size()) - 1;
}

int GlbBuffer::addVec2(std::span<const Vec2> values) {
  return addAccessor(addView(values.data(), values.size_bytes(), kArrayBuffer), kFloat, "VEC2", values.size());
}

int GlbBuffer::addVec3(std::span<const Vec3> values, bool withBounds) {
  const int accessor =
      addAccessor(addView(values.data(), values.size_bytes(), kArrayBuffer), kFloat, "VEC3", values.size());
  if (withBounds && !values.empty()) {
    Vec3 least = values[0];
    Vec3 most = values[0];
    for (const Vec3& v : values) {
      least = glm::min(least, v);
      most = glm::max(most, v);
    }
    accessors_.back()["min"] = {least.x, least.y, least.z};
    accessors_.back()["max"] = {most.x, most.y, most.z};
  }
  return accessor;
}

int GlbBuffer::addVec4(std::span<const Vec4> values) {
  return addAccessor(addView(values.data(), values.size_bytes(), kArrayBuffer), kFloat, "VEC4", values.size());
}

int GlbBuffer::addIndices(std::span<const std::uint32_t> indices, std::size_t vertexCount) {
  // 65535 itself is the primitive restart value and not allowed as an index.
  if (vertexCount <= 65535) {
    std::vector<std::uint16_t> narrow(indices.size());
    std::transform(indices.begin(), indices.end(), narrow.begin(),
                   [](std::uint32_t i) { return static_cast<std::uint16_t>(i); });
    return addAccessor(addView(narrow.data(), narrow.size() * sizeof(std::uint16_t), kElementArrayBuffer),
                       kUnsignedShort, "SCALAR", narrow.size());
  }
  return addAccessor(addView(indices.data(), indices.size_bytes(), kElementArrayBuffer), kUnsignedInt, "SCALAR",
                     indices.size());
}

int GlbBuffer::addBytes(std::span<const std::uint8_t> bytes) { return addView(bytes.data(), bytes.size(), kNoTarget); }

}  // namespace lumel
