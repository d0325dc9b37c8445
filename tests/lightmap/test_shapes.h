// Meshes for tests of charts.
#pragma once

#include <numbers>

#include "scene/scene.h"

namespace lumel {

inline constexpr double kTau = 2 * std::numbers::pi;

struct Shape {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> normals;  // empty: shaded flat

  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  /// Both with normals or both without.
  void add(const Shape& other);
  Scene scene() const;
};

Shape box(Vec3 low, Vec3 high);

/// A grid of (columns + 1) x (rows + 1) points; `wrap` joins the last column (row) to the first.
template <class Point>
Shape grid(int columns, int rows, bool wrapColumns, bool wrapRows, Point point) {
  Shape s;
  const int width = wrapColumns ? columns : columns + 1;
  const int height = wrapRows ? rows : rows + 1;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      s.positions.push_back(point(static_cast<double>(x) / columns, static_cast<double>(y) / rows));
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>((y % height) * width + x % width); };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) s.quad(at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
  return s;
}

/// Gives each point the mean of its triangles' normals.
void smoothNormals(Shape& s);

/// The same with points of their own for each triangle, shaded flat.
Shape shadedFlat(const Shape& s);

Shape cylinder(int sides, double radius, double height);  // with caps
Shape torus(int columns, int rows);
Shape sphere(int columns, int rows);  // 2 * columns of its triangles have no area
Shape moebiusStrip();
/// Triangles that share one edge, all around it, wound this way and that.
Shape fanOnOneEdge(std::uint32_t faces);
/// A flat wall of 8 x 3 whose upper part has many points along its lower edge, its lower part one long edge: slivers of
/// rounding size between them.
Shape wallWithTJunctions();

}  // namespace lumel
