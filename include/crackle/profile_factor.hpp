/// L D L^T of a symmetric matrix within its profile, in an arithmetic wider than double.
///
/// Row i is stored from its first nonzero column on; no fill arises to the left of it, so that the result is that of
/// the whole dense matrix, zeros left out. For references: slow, and as accurate as Real allows.
#pragma once

#include <algorithm>
#include <cfloat>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace crackle {

/// IEEE quadruple precision: 113 bits, a relative rounding of 1e-34. long double where it is that (64-bit ARM),
/// which there is no other name for.
#if LDBL_MANT_DIG == 113
using Quad = long double;
#else
__extension__ using Quad = __float128;
#endif

template <class Real>
class ProfileFactor {
 public:
  /// first[i] <= i: the first column of row i that may be nonzero, ever.
  explicit ProfileFactor(std::vector<int> first) : first_(std::move(first)), start_(first_.size() + 1, 0) {
    for (std::size_t i = 0; i < first_.size(); ++i) {
      start_[i + 1] = start_[i] + i + 1 - static_cast<std::size_t>(first_[i]);
    }
    value_.resize(start_.back());
  }

  [[nodiscard]] int size() const { return static_cast<int>(first_.size()); }
  /// Multiplications of one factorization, about.
  [[nodiscard]] double work() const {
    double sum = 0;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const auto length = static_cast<double>(start_[i + 1] - start_[i]);
      sum += length * length / 2;
    }
    return sum;
  }

  void clear() { std::ranges::fill(value_, Real(0)); }
  /// Entry (row, column), column <= row, within the profile.
  [[nodiscard]] Real& at(int row, int column) { return row_begin(row)[column]; }

  /// Factors in place. A pivot at or below `null` times its diagonal entry is pinned: its unknown's diagonal entry
  /// is doubled, which changes no force where it is 0 but for rounding. The last pivot never is.
  /// Returns the number of pinned pivots.
  int factor(Real null) {
    int pinned = 0;
    for (int i = 0; i < size(); ++i) {
      Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) row[j] -= inner(i, j);  // L_ij D_j so far
      const Real diagonal = row[i];
      for (int j = first_[i]; j < i; ++j) {
        const Real scaled = row[j] / row_begin(j)[j];
        row[i] -= scaled * row[j];
        row[j] = scaled;
      }
      if (i + 1 < size() && !(row[i] > null * diagonal)) {
        row[i] = diagonal > 0 ? diagonal : Real(1);
        ++pinned;
      }
    }
    return pinned;
  }

  [[nodiscard]] Real last_pivot() const { return value_.back(); }

  /// x = K^-1 x.
  void solve(std::span<Real> x) const {
    for (int i = 0; i < size(); ++i) {
      const Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) x[i] -= row[j] * x[j];
    }
    for (int i = 0; i < size(); ++i) x[i] /= row_begin(i)[i];
    for (int i = size() - 1; i >= 0; --i) {
      const Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) x[j] -= row[j] * x[i];
    }
  }

 private:
  /// Indexed by the column itself.
  [[nodiscard]] Real* row_begin(int i) {
    return value_.data() + start_[i] - static_cast<std::size_t>(first_[i]);
  }
  [[nodiscard]] const Real* row_begin(int i) const {
    return value_.data() + start_[i] - static_cast<std::size_t>(first_[i]);
  }
  /// Sum of (L_ik D_k) L_jk over k < j.
  [[nodiscard]] Real inner(int i, int j) const {
    const Real* const a = row_begin(i);
    const Real* const b = row_begin(j);
    Real sum = 0;
    for (int k = std::max(first_[i], first_[j]); k < j; ++k) sum += a[k] * b[k];
    return sum;
  }

  std::vector<int> first_;
  std::vector<std::size_t> start_;
  std::vector<Real> value_;
};

}  // namespace crackle
