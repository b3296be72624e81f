/// The breaks that come next, several at a time, each of them verified against every bond of the network.
///
/// A pass predicts from the bonds most likely to break (TreePredictor), solves for the states after each
/// predicted break (TreeSearch), and keeps what all forces confirm, up to and including the first bond that
/// broke the prediction. A pass in single precision confirms what its margins allow: the set's own forces are known in
/// double from the Gram matrix, and any other bond that may come up to their largest joins the set first; what is left
/// undecided takes a pass in double. The factor stays as it is over several passes: breaks wait, as a low-rank change to
/// it, until there are enough of them to be taken in together.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "crackle/base/phase.hpp"
#include "crackle/equilibrium/tree/tree_candidates.hpp"
#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_followed.hpp"
#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"

namespace crackle {

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
  std::int64_t single = 0;      ///< passes in single precision
  std::int64_t undecided = 0;   ///< of these, followed by one in double
  std::int64_t contenders =
      0;  ///< bonds outside the set that may have been the next ones, as far as single could tell
  double used_margin = 0;  ///< largest error of a stretch in single precision that was seen, over its bound
};

class TreeBatch {
 public:
  /// All arguments must outlive this; scratch: see TreeFactor.
  TreeBatch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
            const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on, Precision precision,
            TreeScratch& scratch, PhaseTimes& times);

  /// A new sample, or one that goes on; the factor is that of it. threshold: [M], infinity for what is broken or can't
  /// break.
  void reset(std::span<const double> threshold);

  /// A bond is gone: one more break waits.
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
  /// Displacements in one of its states; u: [n], idle slots 0. False: the states are gone, since the factor has taken in
  /// what was waiting.
  [[nodiscard]] bool copy_state(int state, std::span<double> u);
  /// u[plate] = 1/F in one of them.
  [[nodiscard]] double plate(int state) const { return plate_[state]; }
  [[nodiscard]] BatchCounts counts() const;

 private:
  [[nodiscard]] bool prepare();
  [[nodiscard]] bool commit();
  void add_columns();
  void solve();
  [[nodiscard]] bool suits_single(double least_stiffness);
  void solve_single();
  void solve_exactly();
  [[nodiscard]] BatchResult verify(double least_stiffness);
  [[nodiscard]] bool agrees(int state) const;
  [[nodiscard]] bool confirm(double least_stiffness);
  [[nodiscard]] bool confirm_state(int state, VerifiedBreak& found);
  [[nodiscard]] bool is_predicted_with(BondId e) const;
  [[nodiscard]] bool follow_contenders();
  [[nodiscard]] bool agrees_in_single();
  [[nodiscard]] bool agrees_with_gram(int state) const;
  void keep(const VerifiedBreak& found, int state, double plate);

  const Network& network_;
  const SeparatorTree& tree_;
  const TreeFactor& factor_;
  PhaseTimes& times_;
  TreeColumns columns_;
  TreeSearch search_;
  TreePredictor predictor_;
  TreeFollowed followed_;
  TreeCandidates candidates_;
  int most_states_;  // in a pass
  int most_exact_states_;
  Prediction prediction_;
  std::vector<BondId> waiting_;  // removed since the factor was current
  std::size_t committed_ = 0;    // of these, known to the predictor
  std::vector<VerifiedBreak> verified_;
  std::vector<double> plate_;       // [verified breaks] of their states
  bool exact_ = true;               // the last pass was in double
  std::vector<double> one_;         // [positions] workspace of copy_state
  std::vector<BondId> contenders_;  // workspace of confirm_state
  CertainState last_;
  bool blind_ = false;                                    // the next pass looks at every bond
  std::array<std::vector<FrontId>, kMostGroups> fronts_;  // workspace of solve
  BatchCounts counts_;
};

}  // namespace crackle
