/// The capacitance matrix C = I - W^T K^-1 W of m broken bonds, W = [w_1 .. w_m], as a Cholesky factor that
/// grows by one row a break.
///
/// Source: M. A. Woodbury, Princeton Statistical Research Group, Memorandum 42 (1950); the new row's squared
/// pivot is the slack 1 - w^T K_m^-1 w, K_m = K - W W^T.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace crackle {

class Capacitance {
 public:
  void clear();
  [[nodiscard]] int size() const { return size_; }

  /// Adds bond m: row = -W^T K^-1 w (size m), diagonal = 1 - w^T K^-1 w. Returns its slack; at or below 0 nothing
  /// was added.
  [[nodiscard]] double grow(std::span<const double> row, double diagonal);

  /// s = C^-1 s (size m).
  void solve(std::span<double> s) const;

  [[nodiscard]] std::size_t bytes() const { return factor_.capacity() * sizeof(double); }

 private:
  void forward(std::span<double> s) const;
  [[nodiscard]] const double* row(int i) const {
    return factor_.data() + static_cast<std::size_t>(i) * (i + 1) / 2;
  }

  std::vector<double> factor_;  ///< lower triangle by rows, packed
  std::vector<double> new_row_;
  int size_ = 0;
};

}  // namespace crackle
