#include "tests/lightmap/test_shapes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/lightmap/chart_checks.h"

namespace lumel {

void Shape::quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  for (const std::uint32_t i : {a, b, c, a, c, d}) indices.push_back(i);
}

void Shape::add(const Shape& other) {
  ASSERT_EQ(normals.empty(), other.normals.empty()) << "one has normals, the other has not";
  const auto base = static_cast<std::uint32_t>(positions.size());
  positions.insert(positions.end(), other.positions.begin(), other.positions.end());
  normals.insert(normals.end(), other.normals.begin(), other.normals.end());
  for (const std::uint32_t i : other.indices) indices.push_back(base + i);
}

Scene Shape::scene() const { return sceneOf(positions, indices, normals); }

Shape box(Vec3 low, Vec3 high) {
  Shape s;
  for (int i = 0; i < 8; ++i)
    s.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  s.quad(0, 4, 6, 2);
  s.quad(1, 3, 7, 5);
  s.quad(0, 1, 5, 4);
  s.quad(2, 6, 7, 3);
  s.quad(0, 2, 3, 1);
  s.quad(4, 5, 7, 6);
  return s;
}

void smoothNormals(Shape& s) {
  std::vector<Vec3d> sums(s.positions.size(), Vec3d(0.0));
  for (std::size_t i = 0; i < s.indices.size(); i += 3) {
    const Vec3d a(s.positions[s.indices[i]]), b(s.positions[s.indices[i + 1]]), c(s.positions[s.indices[i + 2]]);
    for (std::size_t k = 0; k < 3; ++k) sums[s.indices[i + k]] += glm::cross(b - a, c - a);
  }
  s.normals.clear();
  for (const Vec3d& sum : sums) s.normals.push_back(Vec3(glm::normalize(sum)));
}

Shape shadedFlat(const Shape& s) {
  const Scene scene = sceneOf(s.positions, s.indices);
  const Primitive& p = scene.meshes[0].primitives[0];
  Shape flat;
  flat.positions = p.positions;
  flat.normals = p.normals;
  flat.indices = p.indices;
  return flat;
}

Shape cylinder(int sides, double radius, double height) {
  Shape s = grid(sides, 4, true, false, [&](double u, double v) {
    return Vec3(radius * std::cos(kTau * u), radius * std::sin(kTau * u), height * v);
  });
  smoothNormals(s);
  for (const int end : {0, 1}) {  // caps, shaded flat: points of their own
    const auto base = static_cast<std::uint32_t>(s.positions.size());
    for (int i = 0; i < sides; ++i) {
      s.positions.push_back(s.positions[static_cast<std::size_t>(end * 4 * sides + i)]);
      s.normals.push_back(Vec3(0, 0, end ? 1 : -1));
    }
    for (std::uint32_t i = 2; i < static_cast<std::uint32_t>(sides); ++i)
      for (const std::uint32_t k : {0u, end ? i - 1 : i, end ? i : i - 1}) s.indices.push_back(base + k);
  }
  return s;
}

Shape torus(int columns, int rows) {
  Shape s = grid(columns, rows, true, true, [](double u, double v) {
    const double r = 2 + 0.6 * std::cos(kTau * v);
    return Vec3(r * std::cos(kTau * u), r * std::sin(kTau * u), 0.6 * std::sin(kTau * v));
  });
  smoothNormals(s);
  return s;
}

Shape sphere(int columns, int rows) {
  Shape s = grid(columns, rows, true, false, [](double u, double v) {
    const double polar = std::numbers::pi * v;
    // Exact poles, so that they are one point each.
    const double ring = v == 0 || v == 1 ? 0.0 : std::sin(polar);
    return Vec3(ring * std::cos(kTau * u), ring * std::sin(kTau * u), -std::cos(polar));
  });
  s.normals = s.positions;
  return s;
}

Shape moebiusStrip() {
  Shape s;
  constexpr int kSteps = 96;
  for (int i = 0; i < kSteps; ++i)
    for (const double w : {-0.4, 0.4}) {
      const double a = kTau * i / kSteps;
      const double r = 3 + w * std::cos(a / 2);
      s.positions.push_back(Vec3(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2)));
    }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const std::uint32_t next = (i + 1) % kSteps;
    const bool twist = next == 0;
    s.quad(2 * i, 2 * next + (twist ? 1 : 0), 2 * next + (twist ? 0 : 1), 2 * i + 1);
  }
  return s;
}

Shape fanOnOneEdge(std::uint32_t faces) {
  Shape s;
  s.positions = {{0, 0, 0}, {0, 0, 1}};
  for (std::uint32_t i = 0; i < faces; ++i) {
    const double a = kTau * i / faces;
    s.positions.push_back(Vec3(std::cos(a), std::sin(a), 0.5));
    for (const std::uint32_t k : {i % 2 ? 0u : 1u, i % 2 ? 1u : 0u, i + 2}) s.indices.push_back(k);
  }
  return s;
}

Shape wallWithTJunctions() {
  Shape s;
  constexpr std::uint32_t kPoints = 9;
  for (std::uint32_t i = 0; i < kPoints; ++i)
    s.positions.push_back({static_cast<float>(i), i % 2 ? 1.0000001f : 1.0f, i == 4 ? 3e-7f : 0.0f});
  for (std::uint32_t i = 0; i < kPoints; ++i) s.positions.push_back({static_cast<float>(i), 3, 0});
  s.positions.push_back({0, 0, 0});
  s.positions.push_back({8, 0, 0});
  for (std::uint32_t i = 0; i + 1 < kPoints; ++i) s.quad(i, i + 1, kPoints + i + 1, kPoints + i);
  const std::uint32_t a = 2 * kPoints, b = a + 1;
  s.quad(a, b, 8, 0);
  for (std::uint32_t i = 1; i + 1 < kPoints; ++i)
    for (const std::uint32_t k : {0u, i + 1, i}) s.indices.push_back(k);
  return s;
}

}  // namespace lumel
