/// The bonds of one pass whose ratio came near the largest in some state: who leads each state, and who may break soon.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"

namespace crackle {

/// A break that a pass confirmed; the number of the pass's state is its place in the list.
struct VerifiedBreak {
  BondId bond = -1;
  double ratio = 0;  ///< force over threshold at unit plate load
};

class TreeCandidates {
 public:
  /// search must outlive this. wanted: bonds that are ranked, at most.
  TreeCandidates(const TreeSearch& search, std::size_t wanted) : search_(search), wanted_(wanted) {}

  /// A new sample: nobody is ranked.
  void reset();

  /// Where TreeSearch::run lists them; then come fill_ratios, largest, and rank.
  [[nodiscard]] std::vector<BondId>& list() { return bond_; }

  /// Ratios of all in all states of the prediction; 0 once a bond is predicted to be broken. Without a prediction every
  /// bond is listed: leaves those that rank() keeps, and all that tie with them.
  void fill_ratios(const Prediction& prediction);

  /// The same after a single pass, to within its margins.
  void fill_single_ratios(const Prediction& prediction);
  /// Bonds whose ratio, as far as a single pass can tell, may come up to `ratio` in a state: nearly that of the prediction,
  /// or above.
  void find_contenders(int state, double ratio, std::vector<BondId>& contenders) const;

  /// The largest ratio in a state, and of ties the lowest bond; bond -1, ratio 0: nobody carries anything.
  [[nodiscard]] VerifiedBreak largest(int state) const;

  /// By the best ratio, relative to its state's largest, that a bond reaches from state `last` on, which is the last one
  /// that is certain; last_ratio: its largest.
  void rank(const Prediction& prediction, int last, double last_ratio);

  /// Who may break soon, best first.
  [[nodiscard]] std::span<const std::pair<double, BondId>> ranked() const { return ranked_; }
  /// A bond is to be listed from this share of a state's largest ratio on: as many come as are wanted.
  [[nodiscard]] double keep() const { return keep_; }

 private:
  void thin_out();
  static void forget_broken(const Prediction& prediction, BondId e, std::span<double> ratio);

  const TreeSearch& search_;
  std::size_t wanted_;
  std::vector<BondId> bond_;
  std::vector<std::size_t>
      contender_;                // numbers of those that may come up to the predicted ratio in some state
  std::vector<double> ratio_;    // [bonds * states in whole groups]
  std::size_t stride_ = kLanes;  // from one bond's ratios to the next's
  std::vector<std::pair<double, BondId>> ranked_;
  double keep_ = 0;
};

}  // namespace crackle
