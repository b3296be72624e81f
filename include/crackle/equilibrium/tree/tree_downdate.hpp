/// Takes bonds out of a factor: L D L^T -= g g^T for each of many bonds, in one pass over the fronts that they reach.
///
/// A front is read once for all bonds below it. Bond e's vector w starts as g_e on its owner; what a front leaves of it,
/// on its boundary, the parent takes up. Bonds go in the order of their owners, so a front's are neighbours, and those of
/// different subtrees have nothing in common before they meet.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/equilibrium/tree/tree_multifrontal.hpp"
#include "crackle/equilibrium/tree/tree_scratch.hpp"

namespace crackle {

class TreeDowndate {
 public:
  /// Bonds of one pass, at most.
  static constexpr int kMost = 5 * kLanes;

  /// All arguments must outlive this; scratch: this tree's.
  TreeDowndate(const SeparatorTree& tree, const TreeBonds& bonds, const TreeKernels& kernels,
               TreeScratch& scratch);

  struct Slack {
    double smallest =
        1;            ///< 1 - g_e^T K^-1 g_e of a bond, with those before it gone; 0 for what is no number
    double held = 1;  ///< the same, had the plate been held
  };

  /// kMost bonds or fewer, none of them twice.
  Slack run(std::span<const BondId> bonds, const FactorStorage& factor);

  /// The fronts that the last one changed, ascending.
  [[nodiscard]] std::span<const FrontId> path() const { return path_; }
  /// Entries of the factor that were read and written since the start.
  [[nodiscard]] std::int64_t entries_updated() const { return entries_updated_; }

 private:
  /// A front on the path, and the bonds below it.
  struct Visit {
    FrontId f = 0;
    LaneRange bonds;    // their places in sorted_
    std::size_t w = 0;  // where their vectors start in w_: a column of the front's stride for each
  };

  void lay_out(std::span<const BondId> bonds);
  void visit(const Visit& at, const FactorStorage& factor, bool top);
  void start_bonds(const Visit& at);
  void downdate(const Visit& at, const FactorStorage& factor, bool top);
  void downdate_together(const Visit& at, const FactorStorage& factor, double* slack);
  void hand_up(const Visit& at);

  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeKernels& kernels_;
  TreeScratch& scratch_;
  std::vector<BondId> sorted_;
  std::vector<FrontId> path_;
  std::vector<Visit> visit_;           // in the order of path_
  std::vector<std::int32_t> place_;    // [fronts] of those on the path, in path_
  std::vector<std::uint8_t> on_path_;  // [fronts]
  std::vector<PartOfPath> parts_;
  std::vector<FrontId> top_;
  AlignedVector w_;                  // zero between two passes
  std::vector<DowndateStep> steps_;  // of columns that threads share
  std::vector<double> slack_;        // [kMost]
  std::int64_t entries_updated_ = 0;
};

}  // namespace crackle
