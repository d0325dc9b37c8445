#include "lightmap/charts/sparse_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr std::uint32_t kTaskPoints = 4000;  // subtrees of about as many points are tasks
constexpr std::size_t kTasksAtOnce = 32;
constexpr double kMostSteps = 32767.0;

}  // namespace

/// A front's matrix is held as its panel, the columns of the points that it eliminates, and its update, what is then
/// left for the points beyond. As one square it would be twice as large.
struct SparseCholesky::Workspace {
  Eigen::MatrixXd panel, product;
  std::vector<std::uint32_t> place;
};

/// The lower triangle of a symmetric matrix, by columns.
class SparseCholesky::Update {
 public:
  void resize(std::size_t size) {
    size_ = size;
    values_ = std::make_unique<double[]>(size * (size + 1) / 2);
  }
  void clear() { values_.reset(); }
  /// The diagonal's entry, followed by those below it.
  double* column(std::size_t j) const { return values_.get() + j * size_ - j * (j - 1) / 2; }
  double& at(std::size_t i, std::size_t j) const { return column(j)[i - j]; }

 private:
  std::unique_ptr<double[]> values_;
  std::size_t size_ = 0;
};

SparseCholesky::SparseCholesky(std::span<const Vec3d> points, std::span<const std::array<std::uint32_t, 3>> triangles)
    : triangles_(triangles), order_(triangles.size()), rank_(points.size()), step_(points.size()) {
  const Dissection dissection = nestedDissection(points, triangles);
  for (std::uint32_t i = 0; i < dissection.order.size(); ++i) rank_[dissection.order[i]] = i;
  std::vector<std::uint32_t> frontOf(points.size());
  fronts_.reserve(dissection.nodes.size());
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
  const auto frontOfTriangle = [&](std::uint32_t t) {
    const std::array<std::uint32_t, 3> ranks = ranksOf(t);
    return frontOf[std::min({ranks[0], ranks[1], ranks[2]})];
  };
  for (std::uint32_t t = 0; t < triangles.size(); ++t) ++fronts_[frontOfTriangle(t)].triangles;
  std::uint32_t next = 0;
  for (Front& front : fronts_) {
    front.firstTriangle = next;
    next += front.triangles;
    front.triangles = 0;
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    Front& front = fronts_[frontOfTriangle(t)];
    order_[front.firstTriangle + front.triangles++] = t;
  }
  analyse();
}

std::array<std::uint32_t, 3> SparseCholesky::ranksOf(std::uint32_t triangle) const {
  const auto& t = triangles_[triangle];
  return {rank_[t[0]], rank_[t[1]], rank_[t[2]]};
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
      for (const std::uint32_t rank : ranksOf(order_[i])) reach(rank);
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
  values_ = std::make_unique_for_overwrite<std::int16_t[]>(values);
}

std::uint32_t SparseCholesky::localRow(const Front& front, std::uint32_t rank) const {
  if (rank < front.end) return rank - front.begin;
  const auto first = rows_.begin() + front.firstRow;
  return front.end - front.begin +
         static_cast<std::uint32_t>(std::lower_bound(first, first + front.rows, rank) - first);
}

/// The front's matrix before any of its points is gone.
void SparseCholesky::assemble(std::uint32_t index, const Weights& weights, Workspace& work,
                              std::vector<Update>& updates) const {
  const Front& front = fronts_[index];
  const std::uint32_t pivots = front.end - front.begin;
  work.panel.setZero(pivots + front.rows, pivots);
  Update& update = updates[index];
  update.resize(front.rows);
  const auto entry = [&](std::uint32_t a, std::uint32_t b) -> double& {
    const auto [column, row] = std::minmax(a, b);
    return column < pivots ? work.panel(row, column) : update.at(row - pivots, column - pivots);
  };
  for (std::uint32_t i = front.firstTriangle; i < front.firstTriangle + front.triangles; ++i) {
    const std::array<double, 3> w = weights(order_[i]);
    std::array<std::uint32_t, 3> row = ranksOf(order_[i]);
    for (std::uint32_t& r : row) r = localRow(front, r);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = row[k], b = row[(k + 1) % 3];
      entry(a, a) += w[k];
      entry(b, b) += w[k];
      entry(a, b) -= w[k];
    }
  }
  if (pivots > 0 && front.end == rank_.size()) work.panel(pivots - 1, pivots - 1) += 1;
  for (const std::int32_t child : {front.left, front.right}) {
    if (child < 0) continue;
    const Front& from = fronts_[static_cast<std::size_t>(child)];
    Update& passedOn = updates[static_cast<std::size_t>(child)];
    work.place.clear();
    for (std::uint32_t i = 0; i < from.rows; ++i) work.place.push_back(localRow(front, rows_[from.firstRow + i]));
    for (std::size_t j = 0; j < from.rows; ++j) {
      const double* value = passedOn.column(j);
      const std::uint32_t at = work.place[j];  // ascending
      double* column = at < pivots ? &work.panel(at, at) : update.column(at - pivots);
      for (std::size_t i = j; i < from.rows; ++i) column[work.place[i] - at] += *value++;
    }
    passedOn.clear();
  }
}

bool SparseCholesky::eliminate(std::uint32_t index, const Weights& weights, Workspace& work,
                               std::vector<Update>& updates) {
  const Front& front = fronts_[index];
  assemble(index, weights, work, updates);
  const Eigen::Index pivots = work.panel.cols();
  if (pivots == 0) return true;
  Eigen::Ref<Eigen::MatrixXd> corner = work.panel.topRows(pivots);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factored(corner);
  if (factored.info() != Eigen::Success || !corner.diagonal().allFinite()) return false;
  const auto below = static_cast<Eigen::Index>(front.rows);
  auto side = work.panel.bottomRows(below);
  corner.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(side);
  constexpr Eigen::Index kColumns = 64;  // at a time
  for (Eigen::Index first = 0; first < below; first += kColumns) {
    const Eigen::Index columns = std::min(kColumns, below - first);
    work.product.noalias() = side.bottomRows(below - first) * side.middleRows(first, columns).transpose();
    for (Eigen::Index j = 0; j < columns; ++j) {
      Eigen::Map<Eigen::VectorXd> column(updates[index].column(static_cast<std::size_t>(first + j)), below - first - j);
      column -= work.product.col(j).tail(below - first - j);
    }
  }
  store(front, work.panel.data());
  return true;
}

/// `panel`: of a front whose points are eliminated, by columns.
void SparseCholesky::store(const Front& front, const double* panel) {
  const std::size_t pivots = front.end - front.begin;
  const std::size_t size = pivots + front.rows;
  std::int16_t* value = values_.get() + front.values;
  for (std::size_t j = 0; j < pivots; ++j) {
    const double* column = panel + j * size;
    double largest = 0;
    for (std::size_t i = j; i < size; ++i) largest = std::max(largest, std::abs(column[i]));
    const float step = static_cast<float>(largest / kMostSteps);
    step_[front.begin + j] = step;
    const double perStep = 1 / static_cast<double>(step);
    for (std::size_t i = j; i < size; ++i)
      *value++ = static_cast<std::int16_t>(column[i] * perStep + std::copysign(0.5, column[i]));  // to the nearest
  }
}

bool SparseCholesky::factorize(const Weights& weights) {
  std::vector<Update> updates(fronts_.size());
  std::atomic<bool> failed = false;
  const auto run = [&](std::uint32_t first, std::uint32_t last, Workspace& work) {
    for (std::uint32_t i = first; i <= last && !failed; ++i)
      if (!eliminate(i, weights, work, updates)) failed = true;
  };
  // Subtrees small enough are independent tasks. What joins some of them comes right after these, before what they pass
  // on is more than all that is kept.
  const auto isTask = [&](std::uint32_t i) {
    return fronts_[i].end - fronts_[i + 1 - fronts_[i].subtree].begin <= kTaskPoints;
  };
  std::vector<std::uint32_t> parts, tasks, joints;
  for (auto i = static_cast<std::uint32_t>(fronts_.size()); i-- > 0;) {
    parts.push_back(i);
    if (isTask(i)) i -= fronts_[i].subtree - 1;
  }
  std::reverse(parts.begin(), parts.end());
  Workspace joining;
  const auto flush = [&] {
    parallelFor(tasks.size(), 1, [&](std::size_t from, std::size_t to) {
      Workspace work;
      for (std::size_t t = from; t < to; ++t) run(tasks[t] + 1 - fronts_[tasks[t]].subtree, tasks[t], work);
    });
    for (const std::uint32_t joint : joints) run(joint, joint, joining);
    tasks.clear();
    joints.clear();
  };
  for (const std::uint32_t part : parts) {
    if (isTask(part) && tasks.size() == kTasksAtOnce) flush();
    (isTask(part) ? tasks : joints).push_back(part);
  }
  flush();
  return !failed;
}

void SparseCholesky::solve(std::span<Vec2d> x) const {
  for (const Front& front : fronts_) {
    const std::int16_t* column = values_.get() + front.values;
    const std::uint32_t* rows = rows_.data() + front.firstRow;
    for (std::uint32_t j = front.begin; j < front.end; ++j) {
      const double step = static_cast<double>(step_[j]);
      x[j] /= step * *column++;
      const Vec2d times = step * x[j];
      for (std::uint32_t i = j + 1; i < front.end; ++i) x[i] -= static_cast<double>(*column++) * times;
      for (std::uint32_t i = 0; i < front.rows; ++i) x[rows[i]] -= static_cast<double>(*column++) * times;
    }
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const std::uint32_t* rows = rows_.data() + front.firstRow;
    for (std::uint32_t j = front.end; j-- > front.begin;) {
      const std::size_t pivot = j - front.begin;
      const std::size_t length = front.end - front.begin + front.rows;
      const std::int16_t* column = values_.get() + front.values + pivot * length - pivot * (pivot - 1) / 2;
      const double step = static_cast<double>(step_[j]);
      const double diagonal = *column++;
      Vec2d sum = x[j] / step;
      for (std::uint32_t i = j + 1; i < front.end; ++i) sum -= static_cast<double>(*column++) * x[i];
      for (std::uint32_t i = 0; i < front.rows; ++i) sum -= static_cast<double>(*column++) * x[rows[i]];
      x[j] = sum / diagonal;
    }
  }
}

}  // namespace lumel
