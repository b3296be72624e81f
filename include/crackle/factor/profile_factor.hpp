/// L D L^T of a symmetric matrix within its profile, in an arithmetic wider than double, and kept current while
/// rank-one terms are taken away.
///
/// Row i is stored from its first nonzero column on; no fill arises to the left of it, so that the result is that of
/// the whole dense matrix, zeros left out. Slow, and as accurate as Real allows.
#pragma once

#include <algorithm>
#include <cfloat>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace crackle {

/// IEEE quadruple precision: 113 bits, a relative rounding of 1e-34. long double where it is that (64-bit ARM),
/// which there is no other name for.
#if LDBL_MANT_DIG == 113
using Quad = long double;
#else
__extension__ using Quad = __float128;
#endif

/// Entries of a factor with this profile, the diagonal included.
[[nodiscard]] inline std::size_t profile_entries(std::span<const int> first) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < first.size(); ++i) sum += i + 1 - static_cast<std::size_t>(first[i]);
  return sum;
}

/// Multiplications of its factorization, about.
[[nodiscard]] inline double profile_work(std::span<const int> first) {
  double sum = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto length = static_cast<double>(i + 1 - static_cast<std::size_t>(first[i]));
    sum += length * length / 2;
  }
  return sum;
}

template <class Real>
class ProfileFactor {
 public:
  /// first[i] <= i: the first column of row i that may be nonzero, ever.
  explicit ProfileFactor(std::vector<int> first)
      : first_(std::move(first)),
        start_(first_.size() + 1, 0),
        value_(profile_entries(first_)),
        pinned_(first_.size(), 0),
        scale_(first_.size()) {
    for (std::size_t i = 0; i < first_.size(); ++i) {
      start_[i + 1] = start_[i] + i + 1 - static_cast<std::size_t>(first_[i]);
    }
  }

  [[nodiscard]] int size() const { return static_cast<int>(first_.size()); }
  [[nodiscard]] std::size_t entries() const { return value_.size(); }
  [[nodiscard]] bool is_pinned(int i) const { return pinned_[i] != 0; }
  [[nodiscard]] Real pivot(int i) const { return row_begin(i)[i]; }

  void clear() { std::ranges::fill(value_, Real(0)); }
  /// Entry (row, column), column <= row, within the profile.
  [[nodiscard]] Real& at(int row, int column) { return row_begin(row)[column]; }

  /// Factors in place. judge(i, pivot, diagonal) says what pivot i shall be, 0: none, its unknown is held at 0 from
  /// here on. It may call null_vector(i). False as soon as it has said a negative one: no factor then.
  template <class Judge>
  [[nodiscard]] bool factor(Judge judge) {
    std::ranges::fill(pinned_, std::uint8_t{0});
    for (int i = 0; i < size(); ++i) {
      Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) {
        row[j] = is_pinned(j) ? Real(0) : row[j] - inner(i, j);  // L_ij D_j so far
      }
      const Real diagonal = row[i];
      for (int j = first_[i]; j < i; ++j) {
        const Real scaled = row[j] / row_begin(j)[j];
        row[i] -= scaled * row[j];
        row[j] = scaled;
      }
      row[i] = judge(i, row[i], diagonal);
      if (row[i] < 0) return false;
      if (row[i] == 0) pin(i);
    }
    return true;
  }

  /// z with z_i = 1, nothing beyond i, held unknowns 0, and K z = D_i e_i in the first rows up to i: of all such z the
  /// one of least energy z^T K z = D_i. Size of z: n.
  void null_vector(int i, std::span<Real> z) const {
    std::ranges::fill(z, Real(0));
    z[i] = 1;
    back_substitute(i, z);
  }

  /// K - share w w^T, w (size n) nonzero from `begin` on; w is overwritten. Returns the slack, the determinant after
  /// over that before: at or below 0 there is no factor any more, and digits are lost as it tends to 0.
  /// Source: method C1 of P. Gill, G. Golub, W. Murray, M. Saunders, Math. Comp. 28 (1974) 505, row by row.
  [[nodiscard]] Real downdate(int begin, std::span<Real> w, Real share) {
    Real left = -share;
    for (int i = begin; i < size(); ++i) {
      Real* const row = row_begin(i);
      Real wi = std::exchange(w[i], Real(0));
      scale_[i] = 0;
      if (is_pinned(i)) continue;
      for (int j = std::max(begin, first_[i]); j < i; ++j) {
        wi -= w[j] * row[j];
        row[j] += scale_[j] * wi;
      }
      const Real before = row[i];
      row[i] += left * wi * wi;
      if (!(row[i] > 0)) return 0;
      w[i] = wi;
      scale_[i] = wi * left / row[i];
      left *= before / row[i];
    }
    return -share / left;
  }

  /// x = K^-1 x; 0 for a held unknown.
  void solve(std::span<Real> x) const {
    for (int i = 0; i < size(); ++i) {
      const Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) x[i] -= row[j] * x[j];
      if (is_pinned(i)) x[i] = 0;
    }
    for (int i = 0; i < size(); ++i) x[i] /= row_begin(i)[i];
    back_substitute(size() - 1, x);
  }

  /// x = K^-1 e_n, e_n the last unit vector.
  void solve_last(std::span<Real> x) const {
    std::ranges::fill(x, Real(0));
    x[size() - 1] = 1 / value_.back();
    back_substitute(size() - 1, x);
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
  /// x = L^-T x in the first rows up to `last`.
  void back_substitute(int last, std::span<Real> x) const {
    for (int i = last; i >= 0; --i) {
      const Real xi = x[i];
      if (xi == 0) continue;
      const Real* const row = row_begin(i);
      for (int j = first_[i]; j < i; ++j) x[j] -= row[j] * xi;
    }
  }
  void pin(int i) {
    std::fill(row_begin(i) + first_[i], row_begin(i) + i, Real(0));
    row_begin(i)[i] = 1;
    pinned_[i] = 1;
  }

  std::vector<int> first_;
  std::vector<std::size_t> start_;
  std::vector<Real> value_;
  std::vector<std::uint8_t> pinned_;  ///< [n] 1: its row and column are the unit matrix's
  std::vector<Real> scale_;           ///< [n] workspace of downdate
};

}  // namespace crackle
