// Which of the backs that a texel's rays meet are seen from inside of something, by how they gather on few of its
// footprint points. Derivation and figures: baker/README.md.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

namespace lumel {

/// A point is inside of something where its rays meet the backs of single-sided surfaces and nothing else.
struct InsideTally {
  float inside = 0.0f;  // rays that met backs and come from points inside, less those that do so by chance
  float backs = 0.0f;   // all rays that met backs

  /// Of a net with `rays` from each of its points, 2 or more: how many of each met backs.
  void addNet(std::span<const std::uint8_t> backsOfPoints, std::uint32_t rays) {
    constexpr std::uint32_t kDecisive = 8;  // so many rays hardly meet backs alone by chance
    int points = 0;
    for (const std::uint32_t met : backsOfPoints) {
      backs += static_cast<float>(met);
      if (met >= rays - rays / 16)
        ++points;
      else if (rays < kDecisive && met + 1 == rays)
        --points;
    }
    inside += static_cast<float>(points) * static_cast<float>(rays);
  }
  /// Of points with two rays each: bits of those whose first, and whose second, met a back.
  void addPairs(std::uint32_t first, std::uint32_t second) {
    backs += static_cast<float>(std::popcount(first) + std::popcount(second));
    inside += 2.0f * static_cast<float>(std::popcount(first & second) - std::popcount(first ^ second));
  }
  void add(const InsideTally& more) {
    inside += more.inside;
    backs += more.backs;
  }
  /// Share of the rays that met backs.
  float share() const { return backs > 0.0f ? std::clamp(inside / backs, 0.0f, 1.0f) : 0.0f; }
};

}  // namespace lumel
