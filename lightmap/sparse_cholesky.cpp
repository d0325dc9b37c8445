#include "lightmap/sparse_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "scene/parallel.h"

namespace lumel {
namespace {

constexpr std::uint32_t kTaskPoints = 4000;  // subtrees of about as many points are tasks

}  // namespace

struct SparseCholesky::Workspace {
  std::vector<double> front;
  std::vector<std::uint32_t> place;
};

SparseCholesky::SparseCholesky(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles) : rank_(points.size()) {
  const Dissection dissection = nestedDissection(points, triangles);
  for (std::uint32_t i = 0; i < dissection.order.size(); ++i) rank_[dissection.order[i]] = i;
  std::vector<std::uint32_t> frontOf(points.size());
  for (const DissectionNode& node : dissection.nodes) {
    Front front;
    front.begin = node.begin;
    front.end = node.end;
    front.left = node.left;
    front.right = node.right;
    for (const std::int32_t child : {front.left, front.right})
      if (child >= 0) front.subtree += fronts_[static_cast<std::size_t>(child)].subtree;
    for (std::uint32_t r = node.begin; r < node.end; ++r) frontOf[r] = static_cast<std::uint32_t>(fronts_.size());
    fronts_.push_back(front);
  }
  // A triangle goes to the front that eliminates the first of its points; the other two are then in that front as well.
  const auto frontOfTriangle = [&](const std::array<std::uint32_t, 3>& t) {
    return frontOf[std::min({rank_[t[0]], rank_[t[1]], rank_[t[2]]})];
  };
  for (const auto& t : triangles) ++fronts_[frontOfTriangle(t)].triangles;
  std::uint32_t next = 0;
  for (Front& front : fronts_) {
    front.firstTriangle = next;
    next += front.triangles;
    front.triangles = 0;
  }
  ranks_.resize(triangles.size());
  triangle_.resize(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    Front& front = fronts_[frontOfTriangle(triangles[t])];
    const std::uint32_t place = front.firstTriangle + front.triangles++;
    triangle_[place] = t;
    for (std::size_t k = 0; k < 3; ++k) ranks_[place][k] = rank_[triangles[t][k]];
  }
  analyse();
}

/// The rows of every front: what its triangles and its children reach beyond it.
void SparseCholesky::analyse() {
  std::size_t values = 0;
  std::vector<std::uint32_t> reached;
  for (Front& front : fronts_) {
    reached.clear();
    const auto reach = [&](std::uint32_t rank) {
      if (rank >= front.end) reached.push_back(rank);
    };
    for (std::uint32_t i = front.firstTriangle; i < front.firstTriangle + front.triangles; ++i)
      for (const std::uint32_t rank : ranks_[i]) reach(rank);
    for (const std::int32_t child : {front.left, front.right}) {
      if (child < 0) continue;
      const Front& below = fronts_[static_cast<std::size_t>(child)];
      for (std::uint32_t i = 0; i < below.rows; ++i) reach(rows_[below.firstRow + i]);
    }
    std::sort(reached.begin(), reached.end());
    reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
    front.firstRow = static_cast<std::uint32_t>(rows_.size());
    front.rows = static_cast<std::uint32_t>(reached.size());
    rows_.insert(rows_.end(), reached.begin(), reached.end());
    front.values = values;
    const std::size_t pivots = front.end - front.begin;
    values += pivots * (pivots + front.rows) - pivots * (pivots - 1) / 2;
  }
  rows_.shrink_to_fit();
  values_.resize(values);
}

std::uint32_t SparseCholesky::localRow(const Front& front, std::uint32_t rank) const {
  if (rank < front.end) return rank - front.begin;
  const auto first = rows_.begin() + front.firstRow;
  return front.end - front.begin + static_cast<std::uint32_t>(std::lower_bound(first, first + front.rows, rank) - first);
}

bool SparseCholesky::eliminate(std::uint32_t index, const std::function<std::array<double, 3>(std::size_t)>& weights, Workspace& work,
                               std::vector<std::vector<double>>& updates) {
  const Front& front = fronts_[index];
  const auto pivots = static_cast<Eigen::Index>(front.end - front.begin);
  const auto below = static_cast<Eigen::Index>(front.rows);
  const Eigen::Index size = pivots + below;
  work.front.assign(static_cast<std::size_t>(size * size), 0.0);
  Eigen::Map<Eigen::MatrixXd> matrix(work.front.data(), size, size);  // its lower triangle
  for (std::uint32_t i = front.firstTriangle; i < front.firstTriangle + front.triangles; ++i) {
    const std::array<double, 3> w = weights(triangle_[i]);
    std::array<std::uint32_t, 3> row;
    for (std::size_t k = 0; k < 3; ++k) row[k] = localRow(front, ranks_[i][k]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = row[k], b = row[(k + 1) % 3];
      matrix(a, a) += w[k];
      matrix(b, b) += w[k];
      matrix(std::max(a, b), std::min(a, b)) -= w[k];
    }
  }
  if (pivots > 0 && front.end == rank_.size()) matrix(pivots - 1, pivots - 1) += 1;
  for (const std::int32_t child : {front.left, front.right}) {
    if (child < 0) continue;
    const Front& from = fronts_[static_cast<std::size_t>(child)];
    std::vector<double>& update = updates[static_cast<std::size_t>(child)];
    work.place.clear();
    for (std::uint32_t i = 0; i < from.rows; ++i) work.place.push_back(localRow(front, rows_[from.firstRow + i]));
    for (std::size_t j = 0; j < from.rows; ++j)
      for (std::size_t i = j; i < from.rows; ++i) matrix(work.place[i], work.place[j]) += update[j * from.rows + i];
    update = std::vector<double>();  // gives its memory back
  }
  if (pivots > 0) {
    Eigen::Ref<Eigen::MatrixXd> corner = matrix.topLeftCorner(pivots, pivots);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factored(corner);
    if (factored.info() != Eigen::Success || !corner.diagonal().allFinite()) return false;
    auto side = matrix.bottomLeftCorner(below, pivots);
    auto rest = matrix.bottomRightCorner(below, below);
    corner.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(side);
    rest.selfadjointView<Eigen::Lower>().rankUpdate(side, -1.0);
    float* value = values_.data() + front.values;
    for (Eigen::Index j = 0; j < pivots; ++j)
      for (Eigen::Index i = j; i < size; ++i) *value++ = static_cast<float>(matrix(i, j));
  }
  updates[index].resize(static_cast<std::size_t>(below * below));
  Eigen::Map<Eigen::MatrixXd>(updates[index].data(), below, below) = matrix.bottomRightCorner(below, below);
  return true;
}

bool SparseCholesky::factorize(const std::function<std::array<double, 3>(std::size_t)>& weights) {
  std::vector<std::vector<double>> updates(fronts_.size());
  // Subtrees small enough are independent tasks; what joins them comes after.
  std::vector<std::uint32_t> tasks, joints;
  for (std::uint32_t i = static_cast<std::uint32_t>(fronts_.size()); i-- > 0;) {
    const std::uint32_t first = i + 1 - fronts_[i].subtree;
    if (fronts_[i].end - fronts_[first].begin <= kTaskPoints) {
      tasks.push_back(i);
      i = first;
    } else {
      joints.push_back(i);
    }
  }
  std::reverse(joints.begin(), joints.end());
  std::vector<std::uint8_t> failed(tasks.size(), 0);
  parallelFor(tasks.size(), 1, [&](std::size_t from, std::size_t to) {
    Workspace work;
    for (std::size_t task = from; task < to; ++task)
      for (std::uint32_t i = tasks[task] + 1 - fronts_[tasks[task]].subtree; i <= tasks[task] && !failed[task]; ++i)
        failed[task] = !eliminate(i, weights, work, updates);
  });
  Workspace work;
  return std::find(failed.begin(), failed.end(), 1) == failed.end() &&
         std::all_of(joints.begin(), joints.end(), [&](std::uint32_t i) { return eliminate(i, weights, work, updates); });
}

void SparseCholesky::solve(std::vector<Vec2d>& values) const {
  std::vector<Vec2d> x(values.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[rank_[i]] = values[i];
  for (const Front& front : fronts_) {
    const float* column = values_.data() + front.values;
    const std::uint32_t* rows = rows_.data() + front.firstRow;
    for (std::uint32_t j = front.begin; j < front.end; ++j) {
      x[j] /= static_cast<double>(*column++);
      for (std::uint32_t i = j + 1; i < front.end; ++i) x[i] -= static_cast<double>(*column++) * x[j];
      for (std::uint32_t i = 0; i < front.rows; ++i) x[rows[i]] -= static_cast<double>(*column++) * x[j];
    }
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const std::uint32_t* rows = rows_.data() + front.firstRow;
    for (std::uint32_t j = front.end; j-- > front.begin;) {
      const std::size_t pivot = j - front.begin;
      const std::size_t length = front.end - front.begin + front.rows;
      const float* column = values_.data() + front.values + pivot * length - pivot * (pivot - 1) / 2;
      Vec2d sum = x[j];
      const double diagonal = static_cast<double>(*column++);
      for (std::uint32_t i = j + 1; i < front.end; ++i) sum -= static_cast<double>(*column++) * x[i];
      for (std::uint32_t i = 0; i < front.rows; ++i) sum -= static_cast<double>(*column++) * x[rows[i]];
      x[j] = sum / diagonal;
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) values[i] = x[rank_[i]];
}

}  // namespace lumel
