// The light of an emission texture, integrated exactly over polygons, and divided into boxes of nearly even light.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "scene/images/texture.h"

namespace lumel {

/// A convex polygon in texels, either way round. A triangle that is cut by a box has at most 7 corners.
struct TexelPolygon {
  std::array<Vec2d, 12> corners;
  std::size_t count = 0;

  void add(const Vec2d& p) { corners[count++] = p; }
  double area() const;
};

/// A rectangle in texels, its sides along the axes.
struct TexelBox {
  Vec2d min{0};
  Vec2d max{0};

  double area() const { return (max.x - min.x) * (max.y - min.y); }
};

/// Returns what is left of `polygon` inside `box` (Sutherland and Hodgman 1974); fewer than 3 corners where nothing is.
TexelPolygon clipped(const TexelPolygon& polygon, const TexelBox& box);

/// The luminance that a texture sends out as a function on the plane of its texels: x = u * width and y = v * height, v
/// downwards, repeated, mirrored or clamped as the TextureRef says, and interpolated between texel centres unless it is
/// NEAREST. The plane falls into patches on which the function is bilinear (or constant), so integrals are exact up to
/// rounding. Sums over blocks of patches, and a pyramid over these, make an integral cost as much as the polygon's
/// border is long where something shines. Memory: a third of a byte per texel.
class EmissionField {
 public:
  /// The luminance of a texel of linear colour c is dot(perColor, c); what is negative or not finite counts as dark.
  /// Keeps a reference to `texture`.
  EmissionField(const Texture& texture, const TextureRef& ref, const Vec3& perColor);

  /// Returns the point of the plane that texture coordinates stand for.
  Vec2d pointOf(const Vec2& uv) const;
  /// Integrates the luminance over a polygon, in luminance times texels. It is positive exactly where something shines
  /// on a part with area. A polygon that covers more than kMostTiles repetitions gets the texture's mean.
  double integral(const TexelPolygon& polygon) const;
  /// Integrates the square of the luminance over a box.
  double squareIn(const TexelBox& box) const;
  /// Tells whether anything shines within `box`, which may be a line or a point, or at most a thousandth of a texel
  /// beside it.
  bool shinesIn(const TexelBox& box) const;
  /// Divides what shines in a polygon into at most about `most` boxes that together hold all of it, each small about
  /// what shines, and splits those first in which the light varies most. `meters` are the lengths of a texel's sides.
  std::vector<TexelBox> divide(const TexelPolygon& polygon, const Vec2d& meters, std::size_t most) const;

  static constexpr double kMostTiles = 1024;

 private:
  /// How patches lie along an axis: patch i from edges[i] to edges[i + 1]. The value at edge i is the mean of two
  /// texels.
  struct Axis {
    std::vector<double> edges;
    std::vector<std::array<int, 2>> texels;  // by edge; of a NEAREST texture by patch
    double period = 0.0;
    bool tiles = true;
    bool mirrors = false;

    std::size_t patches() const { return edges.size() - 1; }
  };
  /// The integral of the luminance and of its square.
  struct Moments {
    double light = 0.0;
    double square = 0.0;
  };
  /// A level of the pyramid. Entry (x, y) holds the sums over kBlock << level patches on a side.
  struct Level {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<Moments> sums;
  };
  /// One repetition of the texture, as a place of the plane.
  struct Tile {
    Vec2d offset{0};
    std::array<bool, 2> mirrored{};
  };
  static constexpr std::size_t kBlock = 8;

  static Axis axisOf(int size, Wrap wrap, bool nearest);
  void sumUp();
  float texelAt(int x, int y) const;
  float cornerAt(std::size_t x, std::size_t y) const;
  std::array<float, 4> patchAt(std::size_t x, std::size_t y) const;
  TexelBox patchBox(std::size_t x, std::size_t y) const { return boxOf(x, y, 1); }
  TexelBox boxOf(std::size_t x, std::size_t y, std::size_t patches) const;
  std::vector<Tile> tilesOf(const TexelBox& box) const;
  TexelBox tileBox(const Tile& tile) const;
  Vec2d toTile(const Tile& tile, const Vec2d& p) const;
  TexelBox toTile(const Tile& tile, const TexelBox& box) const;
  double integralIn(std::size_t level, std::size_t x, std::size_t y, const TexelPolygon& polygon) const;
  double patchIntegral(std::size_t x, std::size_t y, const TexelPolygon& polygon) const;
  Moments momentsIn(std::size_t level, std::size_t x, std::size_t y, const TexelBox& box) const;
  void growToLit(std::size_t level, std::size_t x, std::size_t y, const TexelBox& box, TexelBox& lit) const;
  bool shrinkToLit(TexelBox& box) const;
  template <class Visit>
  void forBlockPatches(std::size_t x, std::size_t y, Visit visit) const;

  const Texture* texture_;
  Vec3 perColor_;
  bool nearest_;
  Mat3 texelFromUv_;
  Axis x_, y_;
  std::vector<Level> levels_;  // the last is one entry
};

}  // namespace lumel
