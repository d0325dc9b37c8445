// Sparse weighted least squares with many right sides; the door to Eigen for seams.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lumel {

/// One equation: sum of factor * unknown = right side, for each of the right sides.
struct SparseRow {
  static constexpr std::size_t kMost = 9;
  std::array<std::uint32_t, kMost> unknowns{};
  std::array<double, kMost> factors{};
  std::size_t count = 0;

  void add(std::uint32_t unknown, double factor) {
    unknowns[count] = unknown;
    factors[count++] = factor;
  }
};

/// Sums up the normal equations sum w a a^T x = sum w a b and solves them by a Cholesky factorization.
class LeastSquares {
 public:
  LeastSquares(std::size_t unknowns, std::size_t rightSides);

  /// `rightSide`: one value for each.
  void add(const SparseRow& row, double weight, std::span<const double> rightSide);

  /// The solution, unknown by unknown, `rightSides` values each. Empty where the matrix is not positive definite: some
  /// unknown stands in no equation.
  std::vector<double> solve();

 private:
  struct Entry {
    std::uint64_t place;  // column, then row
    double value;
  };
  void mergeEntries();

  std::size_t unknowns_;
  std::size_t rightSides_;
  std::vector<Entry> entries_;  // of the lower triangle
  std::size_t merged_ = 0;      // so many of them, at the front, are in order and differ in place
  std::vector<double> right_;
};

}  // namespace lumel
