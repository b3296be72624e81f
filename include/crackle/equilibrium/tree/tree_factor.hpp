/// Keeps K = L D L^T (SPD, in the separator tree's order) current while bonds break.
///
/// Bond e subtracts g_e g_e^T, g_e = sqrt(k_e) b_e, which changes only the fronts from its owner to the root.
/// A null pivot (floppy unknown of a network that starts with loose parts) is pinned: 1/D is taken as 0, its
/// column is zero, and it stays out of every later update. Bond forces don't depend on it. The plate is never
/// pinned: its pivot is the last, and is F.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_downdate.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/equilibrium/tree/tree_multifrontal.hpp"
#include "crackle/equilibrium/tree/tree_scratch.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// Doubles of the next front that are asked for in advance: what leaves room in a second-level cache.
inline constexpr std::size_t kLookAhead = 1 << 14;

class TreeFactor {
 public:
  /// Keeps a copy of the first factorization if `keep_intact`. All arguments must outlive this; scratch: this tree's.
  TreeFactor(const SeparatorTree& tree, const TreeBonds& bonds, const TreeKernels& kernels, bool keep_intact,
             TreeScratch& scratch);

  /// From scratch, without the bonds for which broken[e] != 0 (size M; empty: none is broken).
  void factorize(std::span<const std::uint8_t> broken);

  /// Back to the intact network: a copy if it was kept, a factorization otherwise.
  void restore();

  /// Removes bonds, none of them twice. Returns the smallest slack 1 - g_e^T K^-1 g_e among them, each with
  /// the earlier ones gone; 0 or below: the factor is no use any more, factorize before it is used again.
  [[nodiscard]] double downdate(std::span<const BondId> bonds);
  /// The same of the last call, had the plate been held: F, on its way to 0, left out.
  [[nodiscard]] double held_slack() const { return held_slack_; }

  /// K u = e_plate by back-substitution alone, one right-hand side. u: [n], idle slots 0.
  void solve_plate(std::span<double> u) const { move_plate(inverse_.back(), u); }
  /// The same with u[plate] given: also where F is lost in rounding.
  void move_plate(double plate, std::span<double> u) const;
  /// x = K^-1 load with the plate held at 0, whatever the load there: also where F is lost. [n] each.
  void solve_held(std::span<const double> load, std::span<double> x) const;

  /// x, by positions, becomes L^-T x.
  void substitute_back(std::span<double> x) const;

  [[nodiscard]] FrontBlock block(FrontId f) const { return block_of(tree_, f, entries_.data()); }
  /// The same, for a forward pass that goes on to front `next`.
  [[nodiscard]] FrontBlock block(FrontId f, FrontId next) const {
    FrontBlock made = block(f);
    const Front& front = tree_.front[next];
    made.ahead = entries_.data() + front.block;
    made.ahead_end = made.ahead + std::min(kLookAhead, static_cast<std::size_t>(front.stride) * front.pivots);
    return made;
  }
  [[nodiscard]] const double* inverse_pivots(FrontId f) const {
    return inverse_.data() + tree_.front[f].first;
  }
  /// Numbers the changes of the factor, and the last of them that met a front: what was read of it before, is old.
  [[nodiscard]] std::int64_t changes() const { return changes_; }
  [[nodiscard]] std::int64_t changed_at(FrontId f) const { return changed_at_[f]; }
  /// F: the plate's pivot.
  [[nodiscard]] double stiffness() const { return diagonal_.back(); }
  /// Of the last factorization, or of the intact one that restore brought back.
  [[nodiscard]] const TreePivots& pivots() const { return pivots_; }
  /// Entries that downdates read and wrote since the start.
  [[nodiscard]] std::int64_t entries_updated() const { return downdate_.entries_updated(); }
  [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

 private:
  template <class Copy>
  void for_each_column(Copy copy);
  void note_change_of_all();

  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeKernels& kernels_;
  bool keep_intact_;
  AlignedVector entries_;         // all blocks
  std::vector<double> diagonal_;  // [positions] D
  std::vector<double> inverse_;   // [positions] 1/D; 0: pinned
  AlignedVector intact_entries_;  // [factor_entries] the blocks' columns from the diagonal down, no padding
  std::vector<double> intact_diagonal_;
  std::vector<double> intact_inverse_;
  TreePivots pivots_;
  TreePivots intact_pivots_;
  std::int64_t changes_ = 0;
  std::vector<std::int64_t> changed_at_;  // [fronts]
  std::int64_t factorizations_ = 0;
  mutable AlignedVector column_;  // [tallest front] workspace of substitute_back
  TreeDowndate downdate_;
  double held_slack_ = 1;
};

}  // namespace crackle
