#include "lightmap/charts/flatten.h"

#include <algorithm>
#include <cmath>

#include "lightmap/charts/chart_rim.h"
#include "lightmap/charts/laplacian_solver.h"

namespace lumel {
namespace {

constexpr double kFlatCosine = 0.9998;  // within 1.15 degrees of the plane: projection shortens by 0.02 %
constexpr double kMaxBadShare = 0.004;  // of a chart's surface, beyond the stretch limit
constexpr double kMaxL2 = 1.03;
constexpr double kSettledTexels = 0.01;  // root mean square: a relaxation that moves less has arrived
constexpr double kSettledL2 = 1e-4;
constexpr int kMaxIterations = 30;

Vec3d chartNormal(const ChartMesh& chart) {
  Vec3d sum(0.0);
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const std::array<std::uint32_t, 3> v = chart.corners(t);
    sum += glm::cross(chart.points[v[1]] - chart.points[v[0]], chart.points[v[2]] - chart.points[v[0]]);
  }
  const double length = glm::length(sum);
  return length > 0 ? sum / length : Vec3d(0, 0, 1);
}

/// Smallest cosine between the plane's normal and any triangle that is not too thin to tell.
double worstCosine(const ChartMesh& chart, Vec3d normal) {
  double worst = 1;
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const std::array<std::uint32_t, 3> v = chart.corners(t);
    const Vec3d n = glm::cross(chart.points[v[1]] - chart.points[v[0]], chart.points[v[2]] - chart.points[v[0]]);
    const double area = glm::length(n);
    if (shortestHeight(layFlat(chart, t)) < kNegligibleTexels) continue;
    worst = std::min(worst, glm::dot(n, normal) / area);
  }
  return worst;
}

std::vector<Vec2d> project(const ChartMesh& chart, Vec3d normal) {
  // Any right-handed basis of the plane (Duff et al. 2017), in double.
  const double sign = std::copysign(1.0, normal.z);
  const double a = -1 / (sign + normal.z);
  const Vec3d x(1 + sign * normal.x * normal.x * a, sign * normal.x * normal.y * a, -sign * normal.x);
  const Vec3d y(normal.x * normal.y * a, sign + normal.y * normal.y * a, -normal.y);
  std::vector<Vec2d> uvs(chart.points.size());
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    const Vec3d p = chart.points[i] - chart.points[0];
    uvs[i] = {glm::dot(x, p), glm::dot(y, p)};
  }
  return uvs;
}

/// The triangle that is most triangles away from the border: errors of unrolling stay smallest from there.
std::uint32_t innermostTriangle(const ChartMesh& chart) {
  std::vector<std::uint32_t> queue;
  std::vector<bool> seen(chart.size(), false);
  for (std::uint32_t t = 0; t < seen.size(); ++t) {
    const std::array<std::int32_t, 3> n = chart.neighbours(t);
    if (n[0] >= 0 && n[1] >= 0 && n[2] >= 0) continue;
    seen[t] = true;
    queue.push_back(t);
  }
  if (queue.empty()) return 0;
  for (std::size_t head = 0; head < queue.size(); ++head)
    for (const std::int32_t n : chart.neighbours(queue[head]))
      if (n >= 0 && !seen[static_cast<std::size_t>(n)]) {
        seen[static_cast<std::size_t>(n)] = true;
        queue.push_back(static_cast<std::uint32_t>(n));
      }
  return queue.back();
}

/// Directions of the triangle's edges (k, k + 1), as layFlat has it.
std::array<Vec2d, 3> edges(const FlatTriangle& f) {
  return {Vec2d(f.x1, 0), Vec2d(f.x2 - f.x1, f.y2), Vec2d(-f.x2, -f.y2)};
}

/// Products of vectors taken as complex numbers.
Vec2d times(Vec2d a, Vec2d b) { return {a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; }
Vec2d conjugate(Vec2d a) { return {a.x, -a.y}; }

/// Lays triangle after triangle beside one that lies already, breadth first: exact where the chart is developable.
/// How each one is turned follows from its neighbour's turn and the angles between their edges. Read off the places of
/// points instead, rounding errors would grow by a factor with every triangle.
std::vector<Vec2d> unroll(const ChartMesh& chart) {
  std::vector<Vec2d> uvs(chart.points.size(), Vec2d(0.0));
  std::vector<std::uint8_t> placed(chart.points.size(), 0);
  std::vector<Vec2d> turn(chart.size(), Vec2d(0.0));  // of layFlat's x axis; 0: not yet laid
  const std::uint32_t first = innermostTriangle(chart);
  turn[first] = Vec2d(1, 0);
  const FlatTriangle flat = layFlat(chart, first);
  uvs[chart.corners(first)[1]] = {flat.x1, 0};
  uvs[chart.corners(first)[2]] = {flat.x2, flat.y2};
  for (const std::uint32_t i : chart.corners(first)) placed[i] = 1;
  std::vector<std::uint32_t> queue = {first};
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const std::uint32_t t = queue[head];
    const std::array<Vec2d, 3> sides = edges(layFlat(chart, t));
    for (std::size_t k = 0; k < 3; ++k) {
      const HalfedgeHandle side = chart.beyond(chart.side(t, k));  // the edge as the neighbour runs it
      if (chart.isBorder(side)) continue;
      const std::uint32_t u = chart.triangleOf(side);
      if (turn[u] != Vec2d(0.0)) continue;
      queue.push_back(u);
      const std::size_t j = chart.numberOf(side);
      const std::array<Vec2d, 3> theirs = edges(layFlat(chart, u));
      turn[u] = glm::normalize(times(times(-sides[k], turn[t]), conjugate(theirs[j])));
      const std::uint32_t from = chart.startOf(side);
      const std::uint32_t apex = chart.corners(u)[(j + 2) % 3];
      if (placed[apex]) continue;
      placed[apex] = 1;
      uvs[apex] = uvs[from] - times(theirs[(j + 2) % 3], turn[u]);
    }
  }
  return uvs;
}

/// Local/global iterations: rotations per triangle, then one solve with a matrix that is factored once.
class RigidRelaxation {
 public:
  explicit RigidRelaxation(const ChartMesh& chart) : chart_(chart), solver_(chart.vertexCount(), chart.size()) {
    factorize();
  }

  /// Iteratively reweighted towards a fourth power of the error: triangles beyond `limit` pull harder, so that the
  /// distortion spreads from where it is worst.
  void emphasiseWorst(const std::vector<Vec2d>& uvs, double limit) {
    emphasis_.resize(chart_.size(), 1.0);
    for (std::size_t t = 0; t < emphasis_.size(); ++t) {
      const double excess = (worstStretch(t, uvs) - 1) / (limit - 1);
      constexpr double kLeast = 0.1, kMost = 4.0;
      const double wanted = std::clamp(excess, kLeast, kMost);
      emphasis_[t] = std::sqrt(emphasis_[t] * wanted * wanted);
    }
    factorize();
  }

  bool usable() const { return usable_; }

  /// One iteration; returns how far points moved, root mean square, or a negative number if the solve failed.
  double step(std::vector<Vec2d>& uvs) const {
    std::vector<Vec2d> move(uvs.size(), Vec2d(0.0));
    for (std::size_t t = 0; t < chart_.size(); ++t) addTriangle(t, uvs, move);
    solver_.solve(move);
    double moved = 0;
    for (std::size_t i = 0; i < uvs.size(); ++i) {
      moved += glm::dot(move[i], move[i]);
      uvs[i] += move[i];
    }
    return std::isfinite(moved) ? std::sqrt(moved / static_cast<double>(uvs.size())) : -1.0;
  }

 private:
  void factorize() {
    usable_ = solver_.factorize([this](std::size_t t) -> LaplacianSolver::Triangle {
      return {chart_.corners(t), cotangents(t, layFlat(chart_, t))};
    });
  }

  /// The larger of the greatest singular value and the inverse of the least; very large where turned over.
  double worstStretch(std::size_t t, const std::vector<Vec2d>& uvs) const {
    const std::array<std::uint32_t, 3> v = chart_.corners(t);
    const SingularValues s = singularValues(layFlat(chart_, t), {uvs[v[0]], uvs[v[1]], uvs[v[2]]});
    return s.small > 0 ? std::max(s.big, 1 / s.small) : 1e3;
  }

  /// The cotangent opposite each edge (k, k + 1). Slivers, whose shape does not matter, are held less tightly than
  /// theirs would have it, so that the matrix stays within what floating point can tell apart.
  std::array<double, 3> cotangents(std::size_t t, const FlatTriangle& flat) const {
    constexpr double kMost = 1e4;
    const std::array<Vec2d, 3> e = edges(flat);
    std::array<double, 3> cot;
    double largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      cot[k] = -glm::dot(e[(k + 1) % 3], e[(k + 2) % 3]) / (flat.x1 * flat.y2);
      largest = std::max(largest, std::abs(cot[k]));
    }
    const double factor = (emphasis_.empty() ? 1.0 : emphasis_[t]) * std::min(1.0, kMost / largest);
    for (double& c : cot) c *= factor;
    return cot;
  }

  /// Adds what the triangle misses of its own edges, turned as fits best: the right side for the move that is left.
  void addTriangle(std::size_t t, const std::vector<Vec2d>& uvs, std::vector<Vec2d>& right) const {
    const FlatTriangle flat = layFlat(chart_, t);
    const std::array<Vec2d, 3> e = edges(flat);
    const std::array<double, 3> weight = cotangents(t, flat);
    const std::array<std::uint32_t, 3> v = chart_.corners(t);
    double cosine = 0, sine = 0;  // of the rotation that fits best, not yet normalised
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d now = uvs[v[(k + 1) % 3]] - uvs[v[k]];
      cosine += weight[k] * glm::dot(e[k], now);
      sine += weight[k] * cross2(e[k], now);
    }
    const double length = std::sqrt(cosine * cosine + sine * sine);
    if (length > 0) {
      cosine /= length;
      sine /= length;
    } else {
      cosine = 1;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d turned(cosine * e[k].x - sine * e[k].y, sine * e[k].x + cosine * e[k].y);
      const Vec2d missing = weight[k] * (turned - (uvs[v[(k + 1) % 3]] - uvs[v[k]]));
      right[v[k]] -= missing;
      right[v[(k + 1) % 3]] += missing;
    }
  }

  const ChartMesh& chart_;
  std::vector<double> emphasis_;  // per triangle: multiplies its cotangents; empty: 1
  LaplacianSolver solver_;
  bool usable_ = false;
};

bool isGood(const ChartMesh& chart, std::span<const Vec2d> uvs, const FlattenOptions& options) {
  const double slack = smallChartSlack(surfaceArea(chart));
  const Stretch stretch = measureStretch(chart, uvs, options.maxStretch * std::sqrt(slack));
  return stretch.flipped == 0 && stretch.badShare <= kMaxBadShare * slack && stretch.l2 <= 1 + (kMaxL2 - 1) * slack;
}

/// Whether unrolling alone was as good as isometric.
bool isDevelopable(const ChartMesh& chart, std::span<const Vec2d> uvs, const FlattenOptions& options) {
  constexpr double kIsometricL2 = 1.0002;
  const Stretch stretch = measureStretch(chart, uvs, std::min(options.maxStretch, 1.02));
  return stretch.flipped == 0 && stretch.badShare <= kMaxBadShare / 4 && stretch.l2 <= kIsometricL2;
}

/// A layout without flips that fails by little of its surface: evens the stretch out.
bool spreadStretch(const ChartMesh& chart, RigidRelaxation& relaxation, std::vector<Vec2d>& uvs,
                   const FlattenOptions& options) {
  constexpr double kHopelessShare = 0.1;        // of the surface
  constexpr std::size_t kMostTriangles = 8000;  // each round is a factorization
  constexpr int kRounds = 8, kStepsPerRound = 4;
  if (chart.size() > kMostTriangles) return false;
  const Stretch before = measureStretch(chart, uvs, options.maxStretch);
  if (before.flipped > 0 || before.badShare > kHopelessShare) return false;
  for (int round = 0; round < kRounds; ++round) {
    relaxation.emphasiseWorst(uvs, options.maxStretch);
    if (!relaxation.usable()) return false;
    for (int i = 0; i < kStepsPerRound; ++i)
      if (relaxation.step(uvs) < 0) return false;
    scaleToSurface(chart, uvs);
    if (isGood(chart, uvs, options)) return true;
  }
  return false;
}

/// Relaxes until nothing moves. False: the chart cannot be laid flat well.
bool relax(const ChartMesh& chart, std::vector<Vec2d>& uvs, const FlattenOptions& options) {
  RigidRelaxation relaxation(chart);
  if (!relaxation.usable()) return false;
  double l2 = 0;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double moved = relaxation.step(uvs);
    if (moved < 0) return false;
    if (moved < kSettledTexels) break;
    // A large chart keeps creeping as a whole long after its triangles have their shape.
    if (i % 4 != 3) continue;
    const Stretch now = measureStretch(chart, uvs, options.maxStretch);
    if (now.flipped == 0 && std::abs(now.l2 - l2) < kSettledL2) break;
    l2 = now.l2;
  }
  scaleToSurface(chart, uvs);
  if (isGood(chart, uvs, options)) return true;
  return spreadStretch(chart, relaxation, uvs, options);
}

}  // namespace

Flattening flatten(const ChartMesh& chart, const FlattenOptions& options) {
  Flattening result;
  if (chart.size() == 1) {
    result.uvs = unroll(chart);
  } else {
    const Vec3d normal = chartNormal(chart);
    const double cosine = worstCosine(chart, normal);
    bool good = false;
    if (cosine >= kFlatCosine) {
      result.uvs = project(chart, normal);
      scaleToSurface(chart, result.uvs);
      good = isGood(chart, result.uvs, options);
    }
    const bool isFlat = good;
    if (!good) {
      result.uvs = unroll(chart);
      good = isDevelopable(chart, result.uvs, options);
    }
    constexpr double kGentleCosine = 0.3;  // a projection that turns nothing over is a fair start
    if (!good && cosine > kGentleCosine) {
      result.uvs = project(chart, normal);
      good = relax(chart, result.uvs, options);
    } else if (!good) {
      good = relax(chart, result.uvs, options);
    }
    if (!good || overlapsItself(chart, result.uvs)) return result;
    if (!isFlat && mixesFarParts(chart, result.uvs)) return result;
  }
  alignToAxes(chart, result.uvs);
  result.valid = packsWell(result.uvs, surfaceArea(chart), options.largestSide);
  return result;
}

}  // namespace lumel
