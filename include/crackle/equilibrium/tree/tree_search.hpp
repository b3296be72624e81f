/// Forces of up to kMostStates states of the network at once, and the bonds in which they matter.
///
/// One backward pass over the tree: the factor is read once for all states. Bonds are looked at as soon as
/// the front that owns them is solved, while its unknowns are in the cache.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"

namespace crackle {

/// States of one pass, in groups of kLanes: a second group finds each front's block still in the cache.
inline constexpr int kMostGroups = 2;
inline constexpr int kMostStates = kMostGroups * kLanes;

class TreeSearch {
 public:
  /// All arguments must outlive this. groups: most that a pass will have, 1 .. kMostGroups.
  TreeSearch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
             const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on, int groups);

  /// A sample's: [M], infinity for what is broken or can't break.
  void set_thresholds(std::span<const double> threshold);
  /// From here on its threshold is infinite.
  void set_broken(BondId e);
  [[nodiscard]] double threshold(BondId e) const { return threshold_[e]; }
  [[nodiscard]] std::span<const double> thresholds() const { return threshold_; }

  /// Displacements of a group's states, positions x kLanes; the caller fills in the right-hand sides, see
  /// TreeColumns::combine.
  [[nodiscard]] double* states(int group) { return x_[group].data(); }

  /// One state's displacements; u: [n], idle slots 0.
  void copy_state(int state, std::span<double> u) const;

  /// Solves, and lists in `candidates` every bond whose ratio exceeds cut[state] (> 0) in some state.
  /// fronts: for each group, where its right-hand sides are not zero, ascending. cut: kLanes for each.
  void run(std::span<const std::vector<FrontId>> fronts, const double* cut, std::vector<BondId>& candidates);

  /// Force over threshold in one state, zero where the bond carries nothing.
  [[nodiscard]] double ratio(BondId e, int state) const;
  /// The same in all states of some groups: writes kLanes ratios for each.
  void ratios(BondId e, int groups, double* ratio) const;
  /// g_e . u: the elongation times sqrt(k).
  [[nodiscard]] double stretch(BondId e, int state) const;
  /// u[plate] = 1/F.
  [[nodiscard]] double plate(int state) const { return at(tree_.positions() - 1, state); }

 private:
  [[nodiscard]] Nothing<double> nothing(int state) const { return {plate(state), 1}; }
  /// Has the memory bring what solving a front will read and write.
  void ask_for(FrontId f, const double* x) const;
  [[nodiscard]] double at(Position position, int state) const {
    return x_[state / kLanes][static_cast<std::size_t>(position) * kLanes + state % kLanes];
  }

  const Network& network_;
  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeFactor& factor_;
  const TreeKernels& kernels_;
  bool magnitude_;
  bool far_;                                  // the states don't fit into a core's cache
  std::array<AlignedVector, kMostGroups> x_;  // [positions * kLanes] each; empty: group not used
  std::vector<double> threshold_;             // [M] infinite: broken, or can't break
  std::vector<double> limit_;  // [stretchable] threshold over sqrt(k), in the order of TreeBonds::by_owner
  std::vector<std::int32_t> found_;          // workspace of run
  std::array<double, kMostStates> least_{};  // elongation that is none, by state
};

}  // namespace crackle
