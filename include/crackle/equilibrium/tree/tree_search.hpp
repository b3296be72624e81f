/// Forces of up to kMostStates states of the network at once, and the bonds in which they matter.
///
/// One backward pass over the tree: the factor is read once for all states. Bonds are looked at as soon as
/// the front that owns them is solved, while its unknowns are in the cache. A pass is exact (in double), or single
/// (TreeSingle: forces to within a margin), or takes the state in which the factor is current, which is solved for already.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_single.hpp"

namespace crackle {

enum class Precision : std::uint8_t {
  single,      ///< most passes search in single precision; what they can't decide takes a pass in double
  all_double,  ///< every pass is in double
};

class TreeSearch {
 public:
  /// All arguments must outlive this. groups: most that a single pass will have, 1 .. kMostGroups; 0: every pass is exact.
  TreeSearch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
             const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on, int single_groups,
             TreeScratch& scratch);

  /// A sample's: [M], infinity for what is broken or can't break.
  void set_thresholds(std::span<const double> threshold);
  /// From here on its threshold is infinite.
  void set_broken(BondId e);
  [[nodiscard]] double threshold(BondId e) const { return threshold_[e]; }
  [[nodiscard]] std::span<const double> thresholds() const { return threshold_; }

  /// The factor has changed: it is read when it is needed.
  void refresh();

  /// Whether single passes can be had.
  [[nodiscard]] bool searches_in_single() const { return single_ != nullptr && single_->in_range(); }

  /// Displacements of a group's states, positions x kLanes; the caller fills in the right-hand sides, see
  /// TreeColumns::combine.
  [[nodiscard]] double* states(int group);
  /// The same for a single pass: of the differences, a row of `lanes` for each position.
  [[nodiscard]] float* single_states() { return single_->states(); }
  [[nodiscard]] int single_lanes() const { return single_->lanes(); }

  /// Solves, and lists in `candidates` every bond whose ratio exceeds cut[state] (> 0) in some state.
  /// fronts: for each group, where its right-hand sides are not zero, ascending. cut: kLanes for each.
  void run(std::span<const std::vector<FrontId>> fronts, const double* cut, std::vector<BondId>& candidates);
  /// The same in single precision: every bond whose ratio may exceed the cut. cut: [kMostStates].
  void run_single(std::span<const std::vector<FrontId>> fronts, std::span<const double> cut,
                  std::vector<BondId>& candidates);
  /// The state in which the factor is current, the only one: lists every bond. Only if single passes can be had.
  void run_base(std::vector<BondId>& candidates);

  /// One state's displacements; u: [n], idle slots 0. Not of a single pass.
  void copy_state(int state, std::span<double> u) const;

  /// Force over threshold in one state, zero where the bond carries nothing. After a single pass to within its margin.
  [[nodiscard]] double ratio(BondId e, int state) const;
  /// The same in all states of some groups: writes kLanes ratios for each. Not of a single pass.
  void ratios(BondId e, int groups, double* ratio) const;
  /// By how much the ratio of a bond may be wrong in a state; 0 of an exact pass.
  [[nodiscard]] double margin(BondId e, int state) const;
  /// The same of a stretch.
  [[nodiscard]] double stretch_margin(int state) const {
    return pass_ == Pass::single ? single_->margin(state) : 0;
  }
  /// Ratios in all states of a single pass, and whether one may come up to least[state]: [single_lanes()] each.
  [[nodiscard]] bool single_ratios(BondId e, std::span<const float> least, std::span<double> ratio) const {
    return single_->ratios(bonds_.place[e], least, ratio);
  }
  /// g_e . u: the elongation times sqrt(k).
  [[nodiscard]] double stretch(BondId e, int state) const;
  /// u[plate] = 1/F. Not of a single pass.
  [[nodiscard]] double plate(int state) const { return at(tree_.positions() - 1, state); }

 private:
  enum class Pass : std::uint8_t { exact, single, base };

  [[nodiscard]] Nothing<double> nothing(int state) const { return {plate(state), 1}; }
  void find_in(FrontId f, int group, const double* cut, std::vector<BondId>& candidates);
  /// Has the memory bring what solving a front will read and write.
  void ask_for(FrontId f, const double* x) const;
  void update_single();
  [[nodiscard]] double at(Position position, int state) const {
    if (pass_ == Pass::base) return single_->base_displacement()[position];
    return x_[state / kLanes][static_cast<std::size_t>(position) * kLanes + state % kLanes];
  }

  const Network& network_;
  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeFactor& factor_;
  const TreeKernels& kernels_;
  bool magnitude_;
  bool far_;  // the states don't fit into a core's cache
  Pass pass_ = Pass::exact;
  std::unique_ptr<TreeSingle> single_;
  bool stale_ = true;                         // the factor has changed since single_ has seen it
  std::array<AlignedVector, kMostGroups> x_;  // [positions * kLanes] each; empty: not used yet
  std::vector<double> threshold_;             // [M] infinite: broken, or can't break
  std::vector<double> limit_;  // [stretchable] threshold over sqrt(k), in the order of TreeBonds::by_owner
  std::vector<std::int32_t> found_;          // workspace of run
  std::array<double, kMostStates> least_{};  // elongation that is none, by state
};

}  // namespace crackle
