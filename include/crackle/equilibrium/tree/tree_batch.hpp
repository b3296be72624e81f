/// The breaks that come next, several at a time, each of them verified against every bond of the network.
///
/// A pass predicts from the bonds most likely to break (TreePredictor), solves for the states after each
/// predicted break (TreeSearch), and keeps what all forces confirm, up to and including the first bond that
/// broke the prediction. The factor stays as it is over several passes: breaks wait, as a low-rank change to
/// it, until there are enough of them to be taken in together.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "crackle/base/phase.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"
#include "crackle/network/neighbourhood.hpp"

namespace crackle {

/// A break that a pass confirmed; the number of the pass's state is its place in the list.
struct VerifiedBreak {
  BondId bond = -1;
  double ratio = 0;  ///< force over threshold at unit plate load
};

enum class BatchResult : std::uint8_t {
  found,   ///< at least one break is verified
  failed,  ///< F is below the limit, or nothing carries a force
  stale,   ///< the factor has to take in the waiting breaks first, then refresh()
};

struct BatchCounts {
  std::int64_t passes = 0;
  std::int64_t repeated = 0;    ///< passes that confirmed nothing or were cut short by rounding
  std::int64_t predicted = 0;   ///< states solved for
  std::int64_t verified = 0;    ///< breaks confirmed
  std::int64_t columns = 0;     ///< forward columns computed
  std::int64_t candidates = 0;  ///< bonds looked at one by one
  std::int64_t fronts = 0;      ///< visited in backward and forward passes
  std::int64_t entries = 0;     ///< of the factor, read in them
};

class TreeBatch {
 public:
  /// All arguments must outlive this; scratch: see TreeFactor.
  TreeBatch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
            const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on, std::span<double> scratch,
            PhaseTimes& times);

  /// A new sample, the factor intact. `threshold` [M], infinity for what can't break, stays the caller's, who
  /// sets it to infinity for bonds as they are removed.
  void reset(std::span<const double> threshold);

  /// A bond that `verified` names is gone: one more break waits.
  void remove(BondId bond);

  /// Breaks that the factor hasn't taken in.
  [[nodiscard]] std::span<const BondId> waiting() const { return waiting_; }
  /// So many of them, or of columns, that the next pass would cost more than taking them in.
  [[nodiscard]] bool full() const;
  /// The factor has taken them in.
  void refresh();

  /// One pass. State 0 is the network as it is; failed is F <= least_stiffness.
  [[nodiscard]] BatchResult next(double least_stiffness);

  /// What the last pass found, in order: break s happens in state s.
  [[nodiscard]] std::span<const VerifiedBreak> verified() const { return verified_; }
  [[nodiscard]] const TreeSearch& search() const { return search_; }
  [[nodiscard]] BatchCounts counts() const;

 private:
  [[nodiscard]] bool prepare();
  [[nodiscard]] bool commit();
  void choose();
  void extend();
  void fill_panel(std::size_t rank);
  void take(BondId e);
  void take_near(BondId e, double force);
  void add_columns();
  void solve();
  [[nodiscard]] BatchResult verify(double least_stiffness);
  void thin_out();
  void fill_ratios();
  [[nodiscard]] bool agrees(int state) const;
  [[nodiscard]] VerifiedBreak largest(int state) const;
  void rank();

  const SeparatorTree& tree_;
  PhaseTimes& times_;
  TreeColumns columns_;
  TreeSearch search_;
  TreePredictor predictor_;
  Neighbourhood neighbourhood_;
  std::size_t first_;  // best-ranked bonds that are followed from the start
  int hops_;           // how near a bond must be to a break to be followed as well
  int most_states_;    // in a pass
  Prediction prediction_;
  std::span<const double> threshold_;
  std::vector<BondId> waiting_;       // removed since the factor was current
  std::size_t committed_ = 0;         // of these, known to the predictor
  std::vector<std::uint8_t> in_set_;  // [M] 1: has a column, or is in list_
  std::vector<BondId> list_;          // columns to be added
  std::vector<BondId> near_;          // workspace of take_near
  std::vector<std::size_t> ring_;     // the same
  std::vector<VerifiedBreak> verified_;
  std::vector<BondId> candidate_;  // bonds whose ratio came within keep_ of the predicted largest one
  std::vector<double> ratio_;      // [candidates * states in whole groups]
  std::size_t stride_ = kLanes;    // from one candidate's ratios to the next's
  std::vector<std::pair<double, BondId>>
      ranked_;  // largest ratio relative to its state's largest, descending
  std::array<std::vector<FrontId>, kMostGroups> fronts_;  // workspace of solve
  double keep_ = 0;
  bool blind_ = false;     // the next pass looks at every bond
  int last_state_ = 0;     // the last one that is certain
  double last_ratio_ = 0;  // its largest ratio
  double last_force_ = 0;  // and the force of the bond that broke in it
  BatchCounts counts_;
};

}  // namespace crackle
