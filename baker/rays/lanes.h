// 16 values side by side: a wave of texels is worked on in plain loops over its lanes, which the compiler turns into
// vector code for the processor at hand.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "scene/base/each_cpu.h"
#include "scene/base/math.h"

namespace lumel {

/// `a` where `condition` holds, else `b`. Both are always computed: with ?: and && loops over lanes may keep branches
/// and then do not become vector code.
[[gnu::always_inline]] inline float pick(bool condition, float a, float b) { return condition ? a : b; }
[[gnu::always_inline]] inline Vec3 pick(bool condition, const Vec3& a, const Vec3& b) {
  return {pick(condition, a.x, b.x), pick(condition, a.y, b.y), pick(condition, a.z, b.z)};
}
/// Clamps x like std::clamp, by value.
[[gnu::always_inline]] inline float within(float x, float least, float most) {
  const float low = x < least ? least : x;
  return low < most ? low : most;
}

/// Texels that advance in step: one lane each, one packet per ray call.
inline constexpr int kLanes = 16;

/// One flag or index for each lane, as wide as a float so that both fit into one loop.
using LaneFlags = std::array<int, kLanes>;

struct alignas(64) Vec3Lanes {
  float x[kLanes] = {};
  float y[kLanes] = {};
  float z[kLanes] = {};

  Vec3 operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(std::size_t lane, const Vec3& v) {
    x[lane] = v.x;
    y[lane] = v.y;
    z[lane] = v.z;
  }
};

struct FrameLanes {
  Vec3Lanes t, b, n;

  Frame operator[](std::size_t lane) const { return {t[lane], b[lane], n[lane]}; }
  void set(std::size_t lane, const Frame& frame) {
    t.set(lane, frame.t);
    b.set(lane, frame.b);
    n.set(lane, frame.n);
  }
};

/// Calls body(lane) for the lanes whose bits are set, in order.
template <class Body>
inline void forEachLane(std::uint32_t lanes, Body body) {
  for (; lanes != 0; lanes &= lanes - 1) body(static_cast<std::size_t>(std::countr_zero(lanes)));
}

/// Holds Count 32-bit values side by side.
template <int Count>
using Words __attribute__((vector_size(4 * Count))) = std::uint32_t;
/// Holds one 32-bit value for each lane.
using LaneWords = Words<kLanes>;

template <std::size_t... I>
[[gnu::always_inline]] inline void join(const Words<sizeof...(I) / 2>& a, const Words<sizeof...(I) / 2>& b,
                                        Words<sizeof...(I)>& both, std::index_sequence<I...>) {
  both = __builtin_shufflevector(a, b, I...);
}

/// Joins rows of Count words into one vector, from the row of `lane` on; `row(lane)` points to each.
template <int Count, int Total, class Row>
[[gnu::always_inline]] inline void joinRows(Row row, std::size_t lane, Words<Total>& joined) {
  if constexpr (Count == Total) {
    std::memcpy(&joined, row(lane), sizeof joined);
  } else {
    Words<Total / 2> low, high;
    joinRows<Count, Total / 2>(row, lane, low);
    joinRows<Count, Total / 2>(row, lane + Total / 2 / Count, high);
    join(low, high, joined, std::make_index_sequence<Total>());
  }
}

/// Transposes a row of Count words for each lane into Count vectors that hold a word of each lane. Plain loops over
/// rows would be compiled to scalar moves.
template <int Count, class Row>
[[gnu::always_inline]] inline void turnRows(Row row, std::array<LaneWords, Count>& columns) {
  static_assert(Count == 2 || Count == 4 || Count == 8);
  for (std::size_t i = 0; i < Count; ++i) joinRows<Count, kLanes>(row, kLanes / Count * i, columns[i]);
  for (int step = 1; step < Count; step *= 2) {
    const std::array<LaneWords, Count> rows = columns;
    for (std::size_t i = 0; i < Count / 2; ++i) {
      const LaneWords& a = rows[2 * i];
      const LaneWords& b = rows[2 * i + 1];
      columns[i] = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
      columns[i + Count / 2] = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    }
  }
}

/// Loads the first Count words of the record that each lane names and stores them as Count rows of lanes at `lanes`.
template <int Count = kLanes, class Record>
[[gnu::always_inline]] inline void turnRecords(const Record* records, const LaneFlags& which, void* lanes) {
  static_assert(sizeof(Record) >= 4 * Count);
  constexpr int kPart = Count < 8 ? Count : 8;
  for (std::size_t first = 0; first < Count; first += kPart) {
    std::array<LaneWords, kPart> columns;
    turnRows<kPart>(
        [&](std::size_t lane) {
          return reinterpret_cast<const std::byte*>(records + which[lane]) + first * sizeof(std::uint32_t);
        },
        columns);
    std::memcpy(static_cast<std::byte*>(lanes) + first * sizeof(LaneWords), columns.data(), sizeof columns);
  }
}

}  // namespace lumel
