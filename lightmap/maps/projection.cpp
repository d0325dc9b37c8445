#include "lightmap/maps/projection.h"

#include <algorithm>
#include <cmath>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Fit's table spans the square [-1, 1]^2 of stereographic coordinates (x, y) / (1 + z); the hemisphere is the disc in
/// it, and what the table holds is smooth past the horizon, so no cell needs care.
constexpr int kTableSize = 96;
constexpr float kTableTop = 0.55f;  // above sin 30 degrees by more than a cell, the table is zero

Vec3d directionOf(double sx, double sy) {
  const double s2 = sx * sx + sy * sy;
  return Vec3d(2 * sx, 2 * sy, 1 - s2) / (1 + s2);
}

/// The normals that Fit is made for: within 30 degrees of flat, uniform by solid angle, with their decode weights.
/// Azimuths come in sixths of a turn, so sums over them keep the three-fold symmetry exactly.
struct ConeNormals {
  static constexpr int kRings = 32;
  static constexpr int kAzimuths = 96;
  std::vector<Vec3d> normals;
  std::vector<Vec3d> weights;

  ConeNormals() {
    const double lowest = std::cos(std::numbers::pi / 6);
    for (int ring = 0; ring < kRings; ++ring)
      for (int azimuth = 0; azimuth < kAzimuths; ++azimuth) {
        const double z = lowest + (1 - lowest) * (ring + 0.5) / kRings;
        const double phi = 2 * std::numbers::pi * (azimuth + 0.5) / kAzimuths;
        const double r = std::sqrt(1 - z * z);
        const Vec3d n(r * std::cos(phi), r * std::sin(phi), z);
        Vec3d w;
        for (int i = 0; i < 3; ++i) w[i] = std::max(0.0, glm::dot(n, Vec3d(kRnmBasis[static_cast<std::size_t>(i)])));
        w *= w;
        normals.push_back(n);
        weights.push_back(w / (w.x + w.y + w.z));
      }
  }
};

/// a of lightmap/maps/README.md ("Fit"): what G = mean w w^T has on its diagonal above the rest.
double diagonalExcess(const ConeNormals& cone) {
  double sum = 0;
  for (const Vec3d& w : cone.weights) sum += glm::dot(w, w) - (w.x * w.y + w.y * w.z + w.z * w.x);
  return sum / (3 * static_cast<double>(cone.weights.size()));
}

/// M / a: the kernels before their constraints, linear in the direction where it is above every normal's horizon.
Mat3 fitMatrix(const ConeNormals& cone) {
  glm::dmat3 sum(0.0);
  for (std::size_t k = 0; k < cone.normals.size(); ++k) sum += glm::outerProduct(cone.weights[k], cone.normals[k]);
  return Mat3(sum / (static_cast<double>(cone.normals.size()) * diagonalExcess(cone)));
}

/// What normals that face away from a direction add to that, over a square of directions.
std::vector<Vec3> fitTable(const ConeNormals& cone) {
  const double scale = 1 / (static_cast<double>(cone.normals.size()) * diagonalExcess(cone));
  std::vector<Vec3> table(kTableSize * kTableSize);
  parallelFor(kTableSize, 4, [&](std::size_t firstRow, std::size_t lastRow) {
    for (std::size_t y = firstRow; y < lastRow; ++y)
      for (std::size_t x = 0; x < kTableSize; ++x) {
        const auto coordinate = [](std::size_t i) { return -1 + 2 * static_cast<double>(i) / (kTableSize - 1); };
        const Vec3d direction = directionOf(coordinate(x), coordinate(y));
        Vec3d sum(0);
        for (std::size_t k = 0; k < cone.normals.size(); ++k)
          sum += cone.weights[k] * std::max(0.0, -glm::dot(cone.normals[k], direction));
        table[y * kTableSize + x] = Vec3(sum * scale);
      }
  });
  return table;
}

Vec3 lookUp(const std::vector<Vec3>& table, const Vec3& dir) {
  const float scale = 0.5f * (kTableSize - 1);
  const float x = std::clamp((dir.x / (1 + dir.z) + 1) * scale, 0.0f, kTableSize - 1.001f);
  const float y = std::clamp((dir.y / (1 + dir.z) + 1) * scale, 0.0f, kTableSize - 1.001f);
  const auto x0 = static_cast<std::size_t>(x);
  const auto y0 = static_cast<std::size_t>(y);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const Vec3* row0 = table.data() + y0 * kTableSize + x0;
  const Vec3* row1 = row0 + kTableSize;
  return (1 - fy) * ((1 - fx) * row0[0] + fx * row0[1]) + fy * ((1 - fx) * row1[0] + fx * row1[1]);
}

/// The nearest point to k with no negative coordinate and the given sum.
Vec3 ontoSimplex(const Vec3& k, float sum) {
  const float low = std::min({k.x, k.y, k.z});
  const float high = std::max({k.x, k.y, k.z});
  const float middle = std::max(std::min(k.x, k.y), std::min(std::max(k.x, k.y), k.z));
  // All three stay positive, or the least is cut off, or the two least are.
  float shift = (k.x + k.y + k.z - sum) / 3;
  if (shift > low) shift = (high + middle - sum) / 2;
  if (shift > middle) shift = high - sum;
  return glm::max(k - shift, Vec3(0.0f));
}

Vec3 fitKernels(const Mat3& matrix, const std::vector<Vec3>& table, const Vec3& dir) {
  Vec3 k = matrix * dir;
  if (dir.z < kTableTop) k += lookUp(table, dir);
  return ontoSimplex(k, 3 * dir.z);
}

}  // namespace

const char* nameOf(Projection projection) {
  switch (projection) {
    case Projection::Raw:
      return "raw";
    case Projection::Flat:
      return "flat";
    case Projection::Fit:
      return "fit";
    case Projection::Signed:
      return "signed";
  }
  return "?";
}

RnmKernels::RnmKernels(Projection projection) : projection_(projection) {
  if (projection != Projection::Fit) return;
  const ConeNormals cone;
  matrix_ = fitMatrix(cone);
  table_ = fitTable(cone);
  float most = 0;
  for (std::size_t y = 0; y < 4 * kTableSize; ++y)
    for (std::size_t x = 0; x < 4 * kTableSize; ++x) {
      const Vec3 dir(directionOf(-1 + 0.5 * (static_cast<double>(x) + 0.5) / kTableSize,
                                 -1 + 0.5 * (static_cast<double>(y) + 0.5) / kTableSize));
      if (dir.z <= 0) continue;
      const Vec3 k = fitKernels(matrix_, table_, dir);
      most = std::max({most, k.x, k.y, k.z});
    }
  // Kernels change by at most 4 per radian (they sum to 3 w.z and their table is less steep); half a step is below
  // 0.003.
  bound_ = most + 0.012f;
}

Vec3 RnmKernels::operator()(const Vec3& dirTangent) const {
  if (!(dirTangent.z > 0)) return Vec3(0.0f);
  if (projection_ == Projection::Fit) return fitKernels(matrix_, table_, dirTangent);
  Vec3 k;
  for (int i = 0; i < 3; ++i) k[i] = glm::dot(dirTangent, kRnmBasis[static_cast<std::size_t>(i)]);
  return projection_ == Projection::Signed ? k : glm::max(k, Vec3(0.0f));
}

std::array<Vec3, 3> finishTexel(Projection projection, const std::array<Vec3, 3>& rnm, const Vec3& flat) {
  if (projection != Projection::Flat) return rnm;
  std::array<Vec3, 3> scaled = rnm;
  for (int channel = 0; channel < 3; ++channel) {
    const double mean = (static_cast<double>(rnm[0][channel]) + rnm[1][channel] + rnm[2][channel]) / 3;
    for (Vec3& map : scaled)
      map[channel] = mean > 0 ? static_cast<float>(map[channel] * (flat[channel] / mean)) : flat[channel];
  }
  return scaled;
}

Vec3 decodeRnm(const std::array<Vec3, 3>& maps, const Vec3& normalTangent, RnmDecode decode) {
  const Vec3 w = rnmWeights(normalTangent, decode);
  return w.x * maps[0] + w.y * maps[1] + w.z * maps[2];
}

}  // namespace lumel
