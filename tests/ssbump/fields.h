// Height fields for tests and benchmarks, made from literal numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "ssbump/occlusion/height_field.h"

namespace lumel::ssbump::fields {

inline HeightField make(int width, int height, bool wrap, const std::function<float(int, int)>& value) {
  HeightField field;
  field.width = width;
  field.height = height;
  field.wrap = wrap;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) field.texels.push_back(value(x, y));
  field.updateRange();
  return field;
}

inline float hashUnit(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::uint32_t h = a * 0x8DA6B343u + b * 0xD8163841u + c * 0xCB1AB31Fu;
  h ^= h >> 15, h *= 0x2C1B3C6Du, h ^= h >> 12, h *= 0x297A2D39u, h ^= h >> 15;
  return static_cast<float>(h >> 8) * 0x1p-24f;
}

/// Octaves of smooth value noise that tiles, of 4 cells across to 2^lastOctave, 0 to `amplitude` texels.
inline HeightField fractal(int width, int height, float amplitude, std::uint32_t lastOctave = 7) {
  HeightField field = make(width, height, true, [&](int px, int py) {
    float sum = 0, weight = 1;
    for (std::uint32_t octave = 2; octave <= lastOctave; ++octave, weight *= 0.5f) {
      const std::uint32_t cells = 1u << octave;
      const float u = static_cast<float>(px) * static_cast<float>(cells) / static_cast<float>(width);
      const float v = static_cast<float>(py) * static_cast<float>(cells) / static_cast<float>(height);
      const auto i = static_cast<std::uint32_t>(u), j = static_cast<std::uint32_t>(v);
      const auto smooth = [](float t) { return t * t * (3 - 2 * t); };
      const float a = smooth(u - static_cast<float>(i)), b = smooth(v - static_cast<float>(j));
      const auto at = [&](std::uint32_t x, std::uint32_t y) { return hashUnit(x % cells, y % cells, 217 + octave); };
      sum += weight *
             ((at(i, j) * (1 - a) + at(i + 1, j) * a) * (1 - b) + (at(i, j + 1) * (1 - a) + at(i + 1, j + 1) * a) * b);
    }
    return sum;
  });
  for (float& h : field.texels) h = (h - field.lowest) / (field.highest - field.lowest) * amplitude;
  field.updateRange();
  return field;
}

/// Bricks of 64x32 texels, each of its own height, with sloping joints; the sides must be multiples of 64.
inline HeightField bricks(int width, int height, float amplitude) {
  return make(width, height, true, [&](int x, int y) {
    const int row = y / 32, shifted = (x + (row & 1) * 32) % width;
    const float dx = static_cast<float>(std::min(shifted % 64, 63 - shifted % 64)),
                dy = static_cast<float>(std::min(y % 32, 31 - y % 32));
    const float own =
        0.8f + 0.2f * hashUnit(static_cast<std::uint32_t>(shifted / 64), static_cast<std::uint32_t>(row), 3);
    return amplitude * own * std::clamp((std::min(dx, dy) - 1) / 3, 0.0f, 1.0f);
  });
}

/// A fractal cut into seven terraces with vertical cliffs.
inline HeightField steps(int width, int height, float amplitude) {
  HeightField field = fractal(width, height, 1);
  for (float& h : field.texels) h = std::floor(h * 6) / 6 * amplitude;
  field.updateRange();
  return field;
}

}  // namespace lumel::ssbump::fields
