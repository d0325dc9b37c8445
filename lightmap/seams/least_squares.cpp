#include "lightmap/seams/least_squares.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

namespace lumel {
namespace {

/// Equations name the same unknowns again and again: entries are merged when so many are new.
constexpr std::size_t kLeastNew = 1 << 18;

}  // namespace

LeastSquares::LeastSquares(std::size_t unknowns, std::size_t rightSides)
    : unknowns_(unknowns), rightSides_(rightSides), right_(unknowns * rightSides, 0.0) {}

void LeastSquares::add(const SparseRow& row, double weight, std::span<const double> rightSide) {
  for (std::size_t i = 0; i < row.count; ++i) {
    const double scaled = weight * row.factors[i];
    for (std::size_t c = 0; c < rightSides_; ++c) right_[row.unknowns[i] * rightSides_ + c] += scaled * rightSide[c];
    for (std::size_t k = 0; k < row.count; ++k)
      if (row.unknowns[k] <= row.unknowns[i])
        entries_.push_back({(std::uint64_t{row.unknowns[k]} << 32) | row.unknowns[i], scaled * row.factors[k]});
  }
  if (entries_.size() - merged_ > std::max(kLeastNew, merged_)) mergeEntries();
}

void LeastSquares::mergeEntries() {
  const auto byPlace = [](const Entry& a, const Entry& b) { return a.place < b.place; };
  const auto middle = entries_.begin() + static_cast<std::ptrdiff_t>(merged_);
  std::stable_sort(middle, entries_.end(), byPlace);
  std::inplace_merge(entries_.begin(), middle, entries_.end(), byPlace);
  std::size_t to = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (to > 0 && entries_[to - 1].place == entries_[i].place)
      entries_[to - 1].value += entries_[i].value;
    else
      entries_[to++] = entries_[i];
  entries_.resize(to);
  merged_ = to;
}

std::vector<double> LeastSquares::solve() {
  mergeEntries();
  using Matrix = Eigen::SparseMatrix<double>;
  const auto n = static_cast<Eigen::Index>(unknowns_);
  Matrix matrix(n, n);
  matrix.reserve(static_cast<Eigen::Index>(entries_.size()));
  std::size_t next = 0;
  for (std::size_t column = 0; column < unknowns_; ++column) {
    matrix.startVec(static_cast<Eigen::Index>(column));
    for (; next < entries_.size() && entries_[next].place >> 32 == column; ++next)
      matrix.insertBack(static_cast<Eigen::Index>(entries_[next].place & 0xFFFFFFFFu),
                        static_cast<Eigen::Index>(column)) = entries_[next].value;
  }
  matrix.finalize();
  const Eigen::SimplicialLLT<Matrix, Eigen::Lower> factor(matrix);
  if (factor.info() != Eigen::Success) return {};
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Rows> right(right_.data(), n, static_cast<Eigen::Index>(rightSides_));
  std::vector<double> solution(right_.size());
  Eigen::Map<Rows>(solution.data(), n, static_cast<Eigen::Index>(rightSides_)) = factor.solve(right);
  return solution;
}

}  // namespace lumel
