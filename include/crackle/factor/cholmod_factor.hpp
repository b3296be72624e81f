/// A sparse LDL^T factor that is kept current by downdates: CHOLMOD's, in a nested-dissection order by
/// METIS's separators.
///
/// K is n x n, symmetric, positive definite but for null pivots (see factor). The order puts the last block,
/// the plate, last, so that the last pivot is K's Schur complement there: F.
/// Source: T. A. Davis, W. W. Hager, SIAM J. Matrix Anal. Appl. 20 (1999) 606 and 22 (2001) 997; Y. Chen et
/// al., ACM Trans. Math. Softw. 35 (2008) 22.
#pragma once

#include <cholmod.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace crackle {

/// Both triangles of a symmetric matrix by rows, columns ascending. A view: the caller owns the arrays.
struct SymmetricRows {
  int n = 0;
  const int* start = nullptr;     ///< [n+1]
  const int* column = nullptr;    ///< [start[n]]
  const double* value = nullptr;  ///< [start[n]]
};

/// w of a change K - w w^T: at most four entries.
struct RankOne {
  std::array<int, 4> row{};
  std::array<double, 4> value{};
  int size = 0;
};

class CholmodFactor {
 public:
  /// Orders (nested dissection, the last `block_size` unknowns last) and analyses the pattern of K, whose
  /// size must be a multiple of block_size. Throws std::runtime_error without memory.
  CholmodFactor(const SymmetricRows& K, int block_size);
  ~CholmodFactor();
  CholmodFactor(const CholmodFactor&) = delete;
  CholmodFactor& operator=(const CholmodFactor&) = delete;

  /// Factors K from scratch; the pattern is the constructor's.
  ///
  /// A null pivot's unknown (see kNullPivot) is pinned: its diagonal entry is doubled, which changes no force, since the
  /// unknown's row of the Schur complement is zero (bond forces are unique where displacements are not). The
  /// last pivot is never pinned. Returns false when K is singular or indefinite even so (F <= 0): the factor
  /// is then unusable until the next factor or restore.
  [[nodiscard]] bool factor(const SymmetricRows& K);

  /// K := K - sum w w^T, where each w w^T lies in K's pattern (exact zeros count as entries), one pass over the union of the paths. Returns the product of the slacks, that is
  /// det K_new / det K_old: 1 - w^T K^-1 w for one w. At or below 0 the factor is unusable; near 0 it is as
  /// inaccurate as the slack is small.
  [[nodiscard]] double downdate(std::span<const RankOne> w);

  /// x = K^-1 b (size n each). With a load on the last unknown only, the forward sweep is left out, unless
  /// `both_sweeps` asks for it: the result is the same.
  void solve(std::span<const double> b, std::span<double> x, bool both_sweeps = false);

  /// Copies the factor as it is now, to be had again by `restore`, as fast as memory goes.
  void keep();
  /// False when nothing was kept.
  bool restore();

  [[nodiscard]] double last_pivot() const;
  [[nodiscard]] std::int64_t entries() const;  ///< nonzeros of L, the diagonal included
  [[nodiscard]] std::int64_t factor_bytes() const { return bytes_; }        ///< with the kept copy
  [[nodiscard]] const std::vector<int>& pinned() const { return pinned_; }  ///< of the last factor call
  /// Of the last factor call: the smallest pivot over its diagonal entry of K, pinned ones and the last left out.
  [[nodiscard]] double smallest_pivot() const { return smallest_pivot_; }
  /// Right after factor: unknowns whose pivot is at or below `least` of its diagonal entry, the pinned ones included.
  [[nodiscard]] std::vector<int> small_pivots(double least) const;
  /// x = L^-T x (unit diagonal, size n): of e_j, the motion with 1 at j and 0 at what is eliminated later, and j's pivot
  /// for its energy.
  void back_substitute(std::span<double> x);

 private:
  void analyse(const SymmetricRows& K, int block_size);
  [[noreturn]] void throw_no_memory() const;
  void factor_afresh(const SymmetricRows& K);
  [[nodiscard]] bool factor_pinned(const SymmetricRows& K);
  [[nodiscard]] std::vector<int> find_null_pivots(const SymmetricRows& K);
  [[nodiscard]] bool pivots_hold(const SymmetricRows& K);
  void run_solve(int system, std::span<const double> b, std::span<double> x);
  void fill_change(std::span<const RankOne> w);
  void collect_path(std::span<const RankOne> w);

  mutable cholmod_common common_{};
  cholmod_factor* analysis_ = nullptr;  ///< symbolic, supernodal where that is faster
  cholmod_factor* factor_ = nullptr;    ///< simplicial LDL^T
  cholmod_sparse* change_ = nullptr;    ///< n x kMostRank, the w in factor order
  cholmod_dense *load_ = nullptr, *x_ = nullptr, *y_ = nullptr, *e_ = nullptr;  ///< workspaces of solve
  std::vector<int> order_, position_;  ///< factor order to unknown, and back
  std::vector<int> path_;              ///< columns that a downdate changes
  std::vector<double> path_pivot_;     ///< their pivots before it
  std::vector<std::uint8_t> on_path_;  ///< [n] marks, all 0 between calls
  std::vector<int> pinned_;
  std::vector<double> pivot_share_;  ///< [n] by columns: pivot over diagonal entry, when they were made
  double smallest_pivot_ = 1;
  std::vector<double> pinned_value_;  ///< K's values with the pins, where there are any
  std::vector<double> kept_;          ///< the factor's values; empty: nothing kept
  std::int64_t bytes_ = 0;
};

}  // namespace crackle
