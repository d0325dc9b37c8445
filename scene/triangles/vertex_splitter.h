// Splits the vertices of an indexed mesh where their corners carry different values (flat normals, tangents).
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

namespace lumel {

/// Ask vertexFor() for every corner in order: corners of one vertex with bitwise the same value share a new vertex.
/// New vertices are numbered in order of first use.
template <class Value>
class VertexSplitter {
 public:
  VertexSplitter(std::size_t vertices, std::size_t corners) : first_(vertices, kNone) {
    sources_.reserve(std::min(corners, 2 * vertices));
    values_.reserve(sources_.capacity());
    next_.reserve(sources_.capacity());
  }

  std::uint32_t vertexFor(std::uint32_t vertex, const Value& value) {
    for (std::uint32_t i = first_[vertex]; i != kNone; i = next_[i])
      if (std::memcmp(&values_[i], &value, sizeof(Value)) == 0) return i;
    const auto created = static_cast<std::uint32_t>(sources_.size());
    sources_.push_back(vertex);
    values_.push_back(value);
    next_.push_back(first_[vertex]);
    first_[vertex] = created;
    return created;
  }

  /// The old vertex that each new one comes from.
  std::span<const std::uint32_t> sources() const { return sources_; }
  std::vector<Value> takeValues() { return std::move(values_); }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> sources_;
  std::vector<Value> values_;
};

}  // namespace lumel
