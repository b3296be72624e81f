/// Forces in single precision, as differences from a state whose forces are known in double; and how wrong they may be.
///
/// K = L D L^T is the factor's network, u the displacements of a state, u0 those of the factor's own (u0 = K^-1 e_plate, in
/// double, anew whenever the factor has changed). The difference d = u - u0 solves L^T d = y, y = D^-1 L^-1 times the sum of
/// g_i c_i over the bonds that have broken since (TreeColumns::combine); L and y are rounded to single precision, and
/// so is every product and sum. What that does to the forces is bounded, whatever K's condition:
///
/// The computed d' leaves a residual r = y - L^T d', componentwise |r_i| <= 2 gamma_i (1/2 + sum_j |L_ji|) |d'|_max, gamma_i
/// = (m + 3) u, u = 2^-24, with m the longest chain of additions in row i: the error of a dot product, that of L and y
/// rounded, and |y_i| bounded by what L^T d' is. A stretch is wrong by g_e . (d - d') = (L^-1 g_e) . r, and L^-1 g_e is
/// zero off the path from the bond's front to the root. There, with (L^-1 g_e)^T D^-1 (L^-1 g_e) = g_e^T K^-1 g_e <= 1 for
/// every bond that is in K, and Cauchy's inequality,
///
///   |g_e . (d - d')| <= W |d'|_max,   W^2 = sum_i D_i (2 gamma_i (1/2 + sum_j |L_ji|))^2 over the worst path,
///
/// to which the sum g_e . d' itself adds 6 u |g_e|_max. margin() is that, per state. No constant in it is fitted.
/// Sources: N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), 3.1 and 8.1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/equilibrium/tree/tree_scratch.hpp"

namespace crackle {

class TreeSingle {
 public:
  /// All arguments must outlive this; the scratch's threads share the work. lanes: states of a pass, kLanes or kMostStates.
  TreeSingle(const SeparatorTree& tree, const TreeBonds& bonds, const TreeFactor& factor,
             const TreeKernels& kernels, bool magnitude, int lanes, TreeScratch& scratch);

  /// Bytes that such an object will take, at most.
  [[nodiscard]] static double bytes(const SeparatorTree& tree);

  [[nodiscard]] int lanes() const { return lanes_; }

  /// A sample's: [stretchable] threshold over sqrt(k), infinity for what is broken, in the order of TreeBonds::by_owner.
  void set_limits(std::span<const double> limit);
  void set_broken(std::int32_t place);
  /// Whether all that a sample brings is far from the ends of single precision.
  [[nodiscard]] bool in_range() const { return in_range_; }

  /// Takes over the factor as it is now: what of it has changed, and u0.
  void refresh();

  /// Stretch g_e . u0 of a bond, by its place in TreeBonds::by_owner, in double.
  [[nodiscard]] double base(std::int32_t place) const { return base_[place]; }
  /// u0 of the plate: 1/F.
  [[nodiscard]] double base_plate() const { return u0_.back(); }
  /// u0, by positions.
  [[nodiscard]] std::span<const double> base_displacement() const { return u0_; }

  /// Differences of the states, positions x lanes(); the caller fills in the right-hand sides of one group of kLanes
  /// after the other (TreeColumns::combine).
  [[nodiscard]] float* states() { return x_.data(); }

  /// Solves, and lists in `candidates`, in no order, every bond that may exceed limit * cut[state] in some
  /// state. fronts: where right-hand sides of a group are not zero, ascending. cut: [kMostStates] > 0.
  void run(std::span<const std::vector<FrontId>> fronts, std::span<const double> cut,
           std::vector<BondId>& candidates);

  /// By how much a stretch of the last run may be wrong, in each state.
  [[nodiscard]] double margin(int state) const { return margin_[state]; }

  /// Ratios of a bond in all states, as the last run found them, and whether one of them may come up to least[state]:
  /// [lanes()] each.
  [[nodiscard]] bool ratios(std::int32_t place, std::span<const float> least, std::span<double> ratio) const;
  /// g_e . u in one state.
  [[nodiscard]] double stretch(std::int32_t place, int state) const;

 private:
  /// What a thread works in.
  struct Member {
    AlignedVector column;             // [tallest front]
    std::vector<double> sum;          // [widest front]
    std::vector<std::int32_t> found;  // [bonds looked at together]
  };
  /// What is found in a part of the tree.
  struct Share {
    alignas(AlignedAllocator<float>::kCacheLine) std::array<float, kMostStates> most{};  // |d'|_max
    std::vector<BondId> candidates;
  };

  void measure_values();
  void settle(FrontId f, Member& member);
  void find_base(std::int32_t begin, std::int32_t end);
  void note_given(std::span<const std::vector<FrontId>> fronts);
  void clear_others(FrontId f);
  void solve_front(FrontId f, Share& share);
  void solve_together(FrontId f);
  void solve_subtree(FrontId first, FrontId last, Member& member, Share& share);
  void find_in(FrontId first, FrontId last, Member& member, Share& share) const;
  void gather(std::vector<BondId>& candidates);
  [[nodiscard]] bool guessed_well();
  [[nodiscard]] SingleBlock block(FrontId f) const;

  alignas(AlignedAllocator<float>::kCacheLine) std::array<float, kMostStates> cut_{};
  alignas(AlignedAllocator<float>::kCacheLine) std::array<float, kMostStates> guess_{};  // of margin_
  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeFactor& factor_;
  const TreeKernels& kernels_;
  TreeScratch& scratch_;
  std::int64_t seen_ = 0;           // change of the factor that is taken over
  double error_per_size_ = 0;       // of a stretch, for |d'|_max = 1
  double largest_value_ = 0;        // of |g_e|
  std::vector<std::size_t> block_;  // [fronts] where each one's starts in
  SingleVector entries_;
  std::vector<double> weight_;       // [fronts] each front's part of W^2
  std::vector<double> path_weight_;  // [fronts] the sum of it from there to the root
  std::vector<double> u0_;           // [positions]
  std::vector<double> base_;         // [stretchable] in double
  SingleVector base_single_;         // [stretchable]
  SingleVector value_;               // [stretchable * width] of TreeBonds
  SingleVector limit_;               // [stretchable]
  SingleVector x_;                   // [positions * lanes]
  std::vector<std::uint8_t> given_;  // [fronts] bit g: group g has right-hand sides there
  std::vector<Member> member_;       // [threads]
  std::vector<Share> share_;         // [parts + 1] the last one's is the top
  std::array<double, kMostStates> margin_{};
  int lanes_;
  bool magnitude_;
  bool in_range_ = true;
  bool values_in_range_ = true;
};

}  // namespace crackle
